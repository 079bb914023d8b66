// SPDX-License-Identifier: MIT
//! Conversion, search and check of the numbers of a description, over its fields.

use super::error::{ModelError, require};
use super::field::Field;
use super::schema::FieldSchema;
use crate::number::Number;
use std::marker::PhantomData;

/// Part of a description with numbers of type `T`.
pub trait Described<T>: Sized {
    /// The same part with numbers of another type.
    type Over<U>;

    /// Lines of the doc comment.
    const ABOUT: &'static [&'static str] = &[];

    /// Convert all numbers.
    fn map<U>(&self, f: &impl Fn(&T) -> U) -> Self::Over<U>;

    /// Find a number by its path of fields, such as `["friction", "mu", "3"]`.
    fn number_mut(&mut self, path: &[&str]) -> Option<&mut T>;

    /// Refuse single numbers out of range. Tables are checked as a whole by their element.
    fn check_range(&self, element: &str, field: &Field) -> Result<(), ModelError>;

    /// Alternatives of a group, each with its fields.
    fn alternatives() -> Vec<Vec<FieldSchema>> {
        Vec::new()
    }
}

impl<T: Number> Described<T> for T {
    type Over<U> = U;

    #[inline]
    fn map<U>(&self, f: &impl Fn(&T) -> U) -> U {
        f(self)
    }

    fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
        path.is_empty().then_some(self)
    }

    // The range is a constant of each field: inlined, a check is one or two comparisons.
    #[inline(always)]
    fn check_range(&self, element: &str, field: &Field) -> Result<(), ModelError> {
        require(element, field.name, self.re(), |value| field.limit.holds(value), field)
    }
}

impl<T, D: Described<T>> Described<T> for Option<D> {
    type Over<U> = Option<D::Over<U>>;

    #[inline]
    fn map<U>(&self, f: &impl Fn(&T) -> U) -> Self::Over<U> {
        self.as_ref().map(|part| part.map(f))
    }

    fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
        self.as_mut()?.number_mut(path)
    }

    #[inline(always)]
    fn check_range(&self, element: &str, field: &Field) -> Result<(), ModelError> {
        self.as_ref().map_or(Ok(()), |part| part.check_range(element, field))
    }

    fn alternatives() -> Vec<Vec<FieldSchema>> {
        D::alternatives()
    }
}

impl<T, D: Described<T>> Described<T> for Vec<D> {
    type Over<U> = Vec<D::Over<U>>;

    fn map<U>(&self, f: &impl Fn(&T) -> U) -> Self::Over<U> {
        self.iter().map(|part| part.map(f)).collect()
    }

    fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
        let (&index, rest) = path.split_first()?;
        let place = index.parse::<usize>().ok()?;
        // `+3` and `03` would be further paths of the same number.
        if place.to_string() != index {
            return None;
        }
        self.get_mut(place)?.number_mut(rest)
    }

    #[inline]
    fn check_range(&self, _: &str, _: &Field) -> Result<(), ModelError> {
        Ok(())
    }
}

impl<T> Described<T> for PhantomData<T> {
    type Over<U> = PhantomData<U>;

    fn map<U>(&self, _: &impl Fn(&T) -> U) -> PhantomData<U> {
        PhantomData
    }

    fn number_mut(&mut self, _: &[&str]) -> Option<&mut T> {
        None
    }

    fn check_range(&self, _: &str, _: &Field) -> Result<(), ModelError> {
        Ok(())
    }
}
