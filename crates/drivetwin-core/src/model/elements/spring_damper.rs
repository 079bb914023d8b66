// SPDX-License-Identifier: MIT
//! A compliant shaft (paper eq. 8).

use crate::model::Name;
use crate::model::error::{ModelError, require, require_apart};
use crate::model::mechanism::{Mechanism, Spring, SpringLaw};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// `twist' = ω_a - ω_b`; torque `k · twist + c · twist'` on `b`, opposite on `a`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpringDamper<T> {
    /// Unique name.
    pub name: Name,
    /// Driving end.
    pub a: Name,
    /// Driven end.
    pub b: Name,
    /// N·m/rad. Must be >= 0.
    pub stiffness: T,
    /// N·m·s/rad. Must be >= 0.
    pub damping: T,
}

impl<T: Number> SpringDamper<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require(&self.name, "stiffness", self.stiffness.re(), |v| v >= 0.0, ">= 0 N m/rad")?;
        require(&self.name, "damping", self.damping.re(), |v| v >= 0.0, ">= 0 N m s/rad")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let law = SpringLaw::Linear { stiffness: self.stiffness, damping: self.damping };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }
}
