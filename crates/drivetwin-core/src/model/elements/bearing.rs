// SPDX-License-Identifier: MIT
//! Dry and viscous friction of a bearing.

use crate::model::Name;
use crate::model::error::{ModelError, require, require_apart};
use crate::model::friction::{FrictionLaw, FrictionTable};
use crate::model::mechanism::{Friction, Mechanism, Normal};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Torque against the relative speed of `a` and `b` from a table over its magnitude; at rest up to
/// `peak` times the first value is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bearing<T> {
    /// Unique name.
    pub name: Name,
    /// Shaft.
    pub a: Name,
    /// Housing; the ground as a rule.
    pub b: Name,
    /// Relative speed, rad/s, increasing from 0; the last piece goes on beyond the table.
    pub speed: Vec<f64>,
    /// Friction torque, N·m. Must be >= 0.
    pub torque: Vec<T>,
    /// Static over kinetic torque at rest. Must be >= 1.
    pub peak: T,
}

impl<T: Number> Bearing<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        self.law().check(&self.name)?;
        require(&self.name, "peak", self.peak.re(), |v| v >= 1.0, ">= 1")
    }

    fn law(&self) -> FrictionLaw<T> {
        let (slip, mu) = (self.speed.clone(), self.torque.clone());
        FrictionLaw::Table(FrictionTable { slip, mu, extend: true })
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        m.frictions.push(Friction {
            element: self.name.clone(),
            row,
            law: self.law(),
            normal: Normal::Constant(T::of(1.0)),
            peak: self.peak,
            one_way: false,
        });
    }
}
