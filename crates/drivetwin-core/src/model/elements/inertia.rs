// SPDX-License-Identifier: MIT
//! A rotating mass.

use crate::model::Name;
use crate::model::error::{ModelError, require, require_moving};
use crate::model::mechanism::{self, Mechanism};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Inertia on one node: `inertia · ω' = Σ torques`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertia<T> {
    /// Unique name.
    pub name: Name,
    /// Node it turns with.
    pub node: Name,
    /// kg·m². Must be >= 0.
    pub inertia: T,
}

impl<T: Number> Inertia<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)?;
        require(&self.name, "inertia", self.inertia.re(), |v| v >= 0.0, ">= 0 kg m^2")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.node, T::of(1.0))]);
        let (element, inertia) = (self.name.clone(), self.inertia);
        m.inertias.push(mechanism::Inertia { element, row, inertia });
    }
}
