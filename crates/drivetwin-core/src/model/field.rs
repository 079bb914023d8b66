// SPDX-License-Identifier: MIT
//! Statement of one field of an element: kind, unit, limit, default.

use std::fmt;

/// Content of a field. In the schema `Constant` is a number and `Axis` are numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// Unique name of the element; every element has it, so the schema leaves it out.
    Name,
    /// Field without content in JSON.
    Hidden,
    /// Name of a node.
    Node,
    /// Name of an input.
    Input,
    /// One of several words.
    Text,
    /// True or false.
    Flag,
    /// Number with derivatives.
    Number,
    /// Number without derivatives.
    Constant,
    /// Numbers with derivatives.
    Numbers,
    /// Numbers without derivatives.
    Axis,
    /// Rows of numbers without derivatives.
    Rows,
    /// Fields of its own.
    Group,
}

/// Accepted range of a number. Every number must be finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Smallest accepted value.
    pub least: Option<f64>,
    /// Value that must be exceeded.
    pub above: Option<f64>,
    /// Largest accepted value.
    pub most: Option<f64>,
    /// Values that are refused.
    pub not: &'static [f64],
}

/// Value that the Python builder takes where none is given.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Preset {
    /// Number, in the unit of the field.
    Number(f64),
    /// Name of a node.
    Text(&'static str),
}

/// Statement of a field; its help is the doc comment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// Key in JSON.
    pub name: &'static str,
    /// Content.
    pub kind: FieldKind,
    /// Unit of the number or input, empty for one without.
    pub unit: &'static str,
    /// Range of the number, or of each number of a table.
    pub limit: Limit,
    /// Default of the Python builder.
    pub preset: Option<Preset>,
    /// Meaning of a missing field; a field without it is required.
    pub absent: Option<&'static str>,
    /// Accepted words of a text.
    pub choices: &'static [&'static str],
}

impl Limit {
    /// Any finite number.
    pub const FINITE: Self = Self { least: None, above: None, most: None, not: &[] };

    /// Return true for an accepted value.
    #[inline(always)]
    pub fn holds(&self, value: f64) -> bool {
        value.is_finite()
            && self.least.is_none_or(|least| value >= least)
            && self.above.is_none_or(|above| value > above)
            && self.most.is_none_or(|most| value <= most)
            && !self.not.contains(&value)
    }
}

impl Field {
    /// The element or group itself, whose range is that of its fields.
    pub const WHOLE: Self = Self::new("", FieldKind::Group, "");

    /// A required field that accepts any finite number.
    pub const fn new(name: &'static str, kind: FieldKind, unit: &'static str) -> Self {
        let (limit, preset, absent) = (Limit::FINITE, None, None);
        Self { name, kind, unit, limit, preset, absent, choices: &[] }
    }

    /// Accept numbers from `least` on.
    pub const fn at_least(mut self, least: f64) -> Self {
        self.limit.least = Some(least);
        self
    }

    /// Accept numbers greater than `above`.
    pub const fn above(mut self, above: f64) -> Self {
        self.limit.above = Some(above);
        self
    }

    /// Accept numbers up to `most`.
    pub const fn at_most(mut self, most: f64) -> Self {
        self.limit.most = Some(most);
        self
    }

    /// Refuse these numbers.
    pub const fn not(mut self, not: &'static [f64]) -> Self {
        self.limit.not = not;
        self
    }

    /// State the default of the Python builder.
    pub const fn preset(mut self, value: f64) -> Self {
        self.preset = Some(Preset::Number(value));
        self
    }

    /// State the ground as the default node of the Python builder.
    pub const fn grounded(mut self) -> Self {
        self.preset = Some(Preset::Text(super::GROUND));
        self
    }

    /// Make the field optional and state the meaning of its absence.
    pub const fn absent(mut self, meaning: &'static str) -> Self {
        self.absent = Some(meaning);
        self
    }

    /// Accept these words.
    pub const fn one_of(mut self, choices: &'static [&'static str]) -> Self {
        self.choices = choices;
        self
    }
}

/// Accepted range as messages state it, such as `>= 0 N m`.
impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Limit { least, above, most, not } = self.limit;
        let unit = self.unit.replace('·', " ").replace('²', "^2").replace('³', "^3");
        let unit = if unit.is_empty() { unit } else { format!(" {unit}") };
        match (least, above, most, not) {
            (_, Some(above), Some(most), _) => write!(f, "in ({above}, {most}]{unit}"),
            (Some(least), _, Some(most), _) => write!(f, "in [{least}, {most}]{unit}"),
            (Some(least), ..) => write!(f, ">= {least}{unit}"),
            (_, Some(above), ..) => write!(f, "> {above}{unit}"),
            (_, _, Some(most), _) => write!(f, "<= {most}{unit}"),
            (.., []) => f.write_str("finite"),
            (.., [one]) => write!(f, "not {one}"),
            (.., [first, rest @ ..]) => {
                write!(f, "neither {first}")?;
                rest.iter().try_for_each(|value| write!(f, " nor {value}"))
            }
        }
    }
}
