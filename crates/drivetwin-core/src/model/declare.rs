// SPDX-License-Identifier: MIT
//! Declaration of elements and groups: every field is stated once.

/// Select by the kind of a field: contains numbers of type `T`, is a plain number, or is neither.
macro_rules! select_by_kind {
    (Number: $numeric:expr, $constant:expr, $plain:expr) => {
        $numeric
    };
    (Numbers: $numeric:expr, $constant:expr, $plain:expr) => {
        $numeric
    };
    (Group: $numeric:expr, $constant:expr, $plain:expr) => {
        $numeric
    };
    (Hidden: $numeric:expr, $constant:expr, $plain:expr) => {
        $numeric
    };
    (Constant: $numeric:expr, $constant:expr, $plain:expr) => {
        $constant
    };
    ($kind:ident: $numeric:expr, $constant:expr, $plain:expr) => {
        $plain
    };
}

/// Declare an element or group: a struct of serde data and its [`Described`].
///
/// A field is stated as `pub name: Type = Kind("unit").rule(...)` with a [`FieldKind`] and the rules of
/// [`Field`]. Its doc comment is its help. The first paragraph of the doc comment of the struct is the help
/// of the element, the others are its law.
///
/// [`Described`]: super::described::Described
/// [`FieldKind`]: super::field::FieldKind
/// [`Field`]: super::field::Field
macro_rules! described {
    ($(#[doc = $about:literal])+ pub struct $name:ident<T> { $($fields:tt)* }) => {
        described!(@struct [$($about),+] $name [<T>] [<U>] $($fields)*);
    };
    ($(#[doc = $about:literal])+ pub struct $name:ident { $($fields:tt)* }) => {
        described!(@struct [$($about),+] $name [] [] $($fields)*);
    };
    (
        @struct [$($about:literal),+] $name:ident [$($over_t:tt)*] [$($over_u:tt)*]
        $(
            $(#[doc = $help:literal])+
            $(#[serde($($serde:tt)*)])*
            pub $field:ident: $type:ty = $kind:ident($($unit:literal)?)
                $(.$rule:ident($($argument:expr),*))*,
        )+
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name $($over_t)* {
            $(
                $(#[doc = $help])+
                $(#[doc = concat!(" Unit: ", $unit, ".")])?
                $(#[serde($($serde)*)])*
                pub $field: $type,
            )+
        }

        impl<T: $crate::number::Number> $crate::model::Described<T> for $name $($over_t)* {
            type Over<U> = $name $($over_u)*;

            const ABOUT: &'static [&'static str] = &[$($about),+];

            fn map<U>(&self, _f: &impl Fn(&T) -> U) -> Self::Over<U> {
                $name {
                    $($field: $crate::model::declare::select_by_kind!(
                        $kind:
                        <$type as $crate::model::Described<T>>::map(&self.$field, _f),
                        self.$field,
                        ::std::clone::Clone::clone(&self.$field)
                    ),)+
                }
            }

            fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
                let (&field, _rest) = path.split_first()?;
                match field {
                    $(stringify!($field) => $crate::model::declare::select_by_kind!(
                        $kind:
                        <$type as $crate::model::Described<T>>::number_mut(&mut self.$field, _rest),
                        None,
                        None
                    ),)+
                    _ => None,
                }
            }

            #[inline]
            fn check_range(
                &self,
                _element: &str,
                _: &$crate::model::field::Field,
            ) -> Result<(), $crate::model::ModelError> {
                $({
                    // A constant, so that the range of every field is compiled into its comparison.
                    let _field = const {
                        &described!(@field $field $kind($($unit)?) $(.$rule($($argument),*))*)
                    };
                    $crate::model::declare::select_by_kind!(
                        $kind:
                        <$type as $crate::model::Described<T>>::check_range(
                            &self.$field, _element, _field,
                        )?,
                        $crate::model::Described::<f64>::check_range(
                            &self.$field, _element, _field,
                        )?,
                        ()
                    );
                })+
                Ok(())
            }

            fn alternatives() -> Vec<Vec<$crate::model::schema::FieldSchema>> {
                let fields = [$((
                    described!(@field $field $kind($($unit)?) $(.$rule($($argument),*))*),
                    [$($help),+].as_slice(),
                    $crate::model::declare::select_by_kind!(
                        $kind: <$type as $crate::model::Described<T>>::alternatives(), vec![], vec![]
                    ),
                )),+];
                vec![$crate::model::schema::FieldSchema::list(fields)]
            }
        }
    };
    (
        @field $field:ident $kind:ident($($unit:literal)?)
        $(.$rule:ident($($argument:expr),*))*
    ) => {
        $crate::model::field::Field::new(
            stringify!($field),
            $crate::model::field::FieldKind::$kind,
            concat!($($unit)?),
        )$(.$rule($($argument),*))*
    };
}
pub(crate) use {described, select_by_kind};
