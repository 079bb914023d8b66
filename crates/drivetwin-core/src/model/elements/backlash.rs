// SPDX-License-Identifier: MIT
//! A coupling with play.

use crate::model::error::{ModelError, require, require_apart};
use crate::model::mechanism::{Mechanism, Spring, SpringLaw};
use crate::number::Real;
use serde::{Deserialize, Serialize};

/// No torque while the twist lies within the gap; beyond it a spring-damper that can only push.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash<T> {
    /// Unique name.
    pub name: String,
    /// Driving end.
    pub a: String,
    /// Driven end.
    pub b: String,
    /// N·m/rad. Must be > 0.
    pub stiffness: T,
    /// N·m·s/rad. Must be >= 0.
    pub damping: T,
    /// Total gap, rad. Must be >= 0.
    pub gap: T,
}

impl<T: Real> Backlash<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require(&self.name, "stiffness", self.stiffness.re(), |v| v > 0.0, "> 0 N m/rad")?;
        require(&self.name, "damping", self.damping.re(), |v| v >= 0.0, ">= 0 N m s/rad")?;
        require(&self.name, "gap", self.gap.re(), |v| v >= 0.0, ">= 0 rad")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let (stiffness, damping) = (self.stiffness, self.damping);
        let law = SpringLaw::Backlash { stiffness, damping, half_gap: self.gap * 0.5 };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }
}
