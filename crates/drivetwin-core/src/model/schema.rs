// SPDX-License-Identifier: MIT
//! Schema of the elements as data: fields, units, limits, defaults and help.

use super::field::{Field, FieldKind, Limit, Preset};
use serde::Serialize;

/// Schema of one type of element. Every element also has the fields `type` and `name`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ElementSchema {
    /// Content of the field `type`.
    #[serde(rename = "type")]
    pub kind: String,
    /// Noun phrase.
    pub help: String,
    /// Equations and remarks; empty if the help contains everything.
    pub law: String,
    /// Fields in the order of the struct.
    pub fields: Vec<FieldSchema>,
}

/// Schema of one field.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FieldSchema {
    /// Key in JSON.
    pub name: &'static str,
    /// One of node, input, text, flag, number, numbers, rows, group.
    pub kind: &'static str,
    /// True if the core refuses an element without the field.
    pub required: bool,
    /// Meaning of a missing field; null for a required one.
    pub absent: Option<&'static str>,
    /// Default of the Python builder, null if it has none.
    pub default: Option<Preset>,
    /// True if the field takes numbers with derivatives, so that it can be an unknown.
    pub differentiable: bool,
    /// Unit of the number or input, empty for a field without one.
    pub unit: &'static str,
    /// Range of a number or of each number of a table; null for other fields.
    pub limit: Option<LimitSchema>,
    /// Accepted words of a text.
    pub choices: &'static [&'static str],
    /// Alternatives of a group, each with its fields.
    pub alternatives: Vec<Vec<FieldSchema>>,
    /// Meaning.
    pub help: String,
}

/// Range of a number; null where it has no such bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LimitSchema {
    /// Smallest accepted value.
    pub least: Option<f64>,
    /// Value that must be exceeded.
    pub above: Option<f64>,
    /// Largest accepted value.
    pub most: Option<f64>,
    /// Values that are refused.
    pub not: &'static [f64],
    /// Range as messages of the core state it.
    pub text: String,
}

/// Statement of a field, lines of its doc comment, and alternatives of a group.
pub(crate) type Stated<'d> = (Field, &'d [&'d str], Vec<Vec<FieldSchema>>);

impl FieldSchema {
    /// Schemas of the fields of a struct.
    pub(crate) fn list<const N: usize>(fields: [Stated<'_>; N]) -> Vec<Self> {
        fields.into_iter().filter_map(Self::of).collect()
    }

    /// Schema of a field; none for one that the schema leaves out.
    fn of((field, docs, alternatives): Stated<'_>) -> Option<Self> {
        let Limit { least, above, most, not } = field.limit;
        let (kind, is_number) = match field.kind {
            FieldKind::Name | FieldKind::Hidden => return None,
            FieldKind::Node => ("node", false),
            FieldKind::Input => ("input", false),
            FieldKind::Text => ("text", false),
            FieldKind::Flag => ("flag", false),
            FieldKind::Number | FieldKind::Constant => ("number", true),
            FieldKind::Numbers | FieldKind::Axis => ("numbers", true),
            FieldKind::Rows => ("rows", true),
            FieldKind::Group => ("group", false),
        };
        let limit = LimitSchema { least, above, most, not, text: field.to_string() };
        Some(Self {
            name: field.name,
            kind,
            required: field.absent.is_none(),
            absent: field.absent,
            default: field.preset,
            differentiable: matches!(field.kind, FieldKind::Number | FieldKind::Numbers),
            unit: field.unit,
            limit: is_number.then_some(limit),
            choices: field.choices,
            alternatives,
            help: split_paragraphs(docs).0,
        })
    }
}

impl ElementSchema {
    /// Schema of the element whose struct has this name, with the lines of its doc comment.
    pub(crate) fn of(name: &str, docs: &[&str], fields: Vec<FieldSchema>) -> Self {
        let (help, law) = split_paragraphs(docs);
        Self { kind: snake_case(name), help, law, fields }
    }
}

/// First paragraph and the others of a doc comment, each on one line.
fn split_paragraphs(docs: &[&str]) -> (String, String) {
    let joined = |lines: &[&str]| {
        let lines: Vec<&str> = lines.iter().map(|line| line.trim()).collect();
        lines.join(" ").trim().to_owned()
    };
    let end = docs.iter().position(|line| line.trim().is_empty()).unwrap_or(docs.len());
    let (first, others) = docs.split_at(end);
    (joined(first), joined(others))
}

fn snake_case(name: &str) -> String {
    let mut text = String::with_capacity(name.len() + 2);
    for (i, letter) in name.chars().enumerate() {
        if letter.is_ascii_uppercase() && i > 0 {
            text.push('_');
        }
        text.push(letter.to_ascii_lowercase());
    }
    text
}
