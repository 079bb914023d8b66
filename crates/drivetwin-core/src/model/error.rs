// SPDX-License-Identifier: MIT
//! Faults of a description, each naming its element.

use super::Name;
use crate::number::Values;
use std::fmt;
use thiserror::Error;

/// One fault of a model description.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    /// A number lies outside what its meaning allows.
    #[error("{element}: {field} = {value} is impossible; it must be {requirement}")]
    Value {
        /// Name of the element.
        element: String,
        /// Name of the field.
        field: &'static str,
        /// The offending value, SI.
        value: f64,
        /// Accepted values.
        requirement: String,
    },
    /// A friction table or map has unequal lengths or does not increase.
    #[error("{element}: {table} {problem}")]
    Table {
        /// Name of the element.
        element: String,
        /// Name of the table.
        table: &'static str,
        /// Fault of the table.
        problem: &'static str,
    },
    /// Two elements carry one name.
    #[error("{element}: the name is used twice; element names must be unique")]
    DuplicateName {
        /// The name.
        element: String,
    },
    /// An element that acts on a speed sits on the ground.
    #[error("{element}: its node is the ground, which does not turn; name a shaft")]
    OnGround {
        /// Name of the element.
        element: String,
    },
    /// Both flanges of an element sit on the same node.
    #[error("{element}: both flanges are on node {node:?}, so the element has no effect")]
    ShortCircuit {
        /// Name of the element.
        element: String,
        /// The node.
        node: String,
    },
}

/// All faults of a description at once.
#[derive(Clone, Debug, PartialEq, Error)]
pub struct ModelFaults(pub Vec<ModelError>);

impl fmt::Display for ModelFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let texts: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        f.write_str(&texts.join("; "))
    }
}

/// Require a finite number that satisfies `accept`.
#[inline(always)]
pub(crate) fn require<V: Values>(
    element: &str,
    field: &'static str,
    value: V,
    accept: impl Fn(f64) -> bool,
    requirement: &dyn fmt::Display,
) -> Result<(), ModelError> {
    if value.decide(|value| value.is_finite() && accept(value)) {
        Ok(())
    } else {
        Err(refusal(element, field, value.leading(), requirement))
    }
}

/// Kept out of the checks, so that they are inlined.
#[cold]
fn refusal(
    element: &str,
    field: &'static str,
    value: f64,
    requirement: &dyn fmt::Display,
) -> ModelError {
    let (element, requirement) = (element.to_owned(), requirement.to_string());
    ModelError::Value { element, field, value, requirement }
}

/// Require two flanges on different nodes.
pub(crate) fn require_apart(element: &str, a: &Name, b: &Name) -> Result<(), ModelError> {
    if a == b {
        Err(ModelError::ShortCircuit { element: element.to_owned(), node: a.to_string() })
    } else {
        Ok(())
    }
}

/// Require a node that can turn.
pub(crate) fn require_moving(element: &str, node: &str) -> Result<(), ModelError> {
    if node == super::GROUND {
        Err(ModelError::OnGround { element: element.to_owned() })
    } else {
        Ok(())
    }
}
