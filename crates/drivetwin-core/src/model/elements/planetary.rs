// SPDX-License-Identifier: MIT
//! A planetary gear set.

use crate::model::error::{ModelError, require};
use crate::model::mechanism::{Constraint, Mechanism};
use crate::number::Real;
use serde::{Deserialize, Serialize};

/// `ω_sun + z ω_ring = (1 + z) ω_carrier` with z = teeth of ring over teeth of sun, negative for a
/// dual-pinion set (Willis).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planetary<T> {
    /// Unique name.
    pub name: String,
    /// Node of the sun.
    pub sun: String,
    /// Node of the ring.
    pub ring: String,
    /// Node of the carrier.
    pub carrier: String,
    /// Ring over sun teeth. Must not be 0 or -1.
    pub z: T,
}

impl<T: Real> Planetary<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require(&self.name, "z", self.z.re(), |z| z != 0.0 && z != -1.0, "neither 0 nor -1")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let one = T::of(1.0);
        let row =
            m.row(&[(&self.sun, one), (&self.ring, self.z), (&self.carrier, -(self.z + 1.0))]);
        m.constraints.push(Constraint { element: self.name.clone(), row, loss: None });
    }
}
