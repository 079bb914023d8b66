// SPDX-License-Identifier: MIT
//! A planetary gear set.

use crate::model::error::{ModelError, require};
use crate::model::mechanism::{Constraint, Inertia, Mechanism};
use crate::model::{LossTable, Name};
use crate::number::{Number, Values};
use serde::{Deserialize, Serialize};

/// `ω_sun + z ω_ring = (1 + z) ω_carrier` with z = teeth of ring over teeth of sun, negative for a
/// dual-pinion set (Willis).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planetary<T> {
    /// Unique name.
    pub name: Name,
    /// Node of the sun.
    pub sun: Name,
    /// Node of the ring.
    pub ring: Name,
    /// Node of the carrier.
    pub carrier: Name,
    /// Ring over sun teeth. Must not be 0 or -1.
    pub z: T,
    /// Spin inertia of all planets together about their own axes, kg·m²; none if absent. For single
    /// pinions (z > 1), 0 for others. Their orbiting mass belongs to the carrier. Must be >= 0.
    #[serde(default = "Option::default")]
    pub planet_inertia: Option<T>,
    /// Loss torque between sun and carrier over their relative speed and the torque that enters at the sun;
    /// none if absent.
    #[serde(default)]
    pub losses: Option<LossTable>,
}

impl<T: Number> Planetary<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require(&self.name, "z", self.z.re(), |z| z != 0.0 && z != -1.0, "neither 0 nor -1")?;
        self.losses.as_ref().map_or(Ok(()), |losses| losses.check(&self.name))?;
        let Some(spin) = self.planet_inertia else { return Ok(()) };
        require(&self.name, "planet_inertia", spin.re(), |v| v >= 0.0, ">= 0 kg m^2")?;
        if spin.re().decide(|v| v == 0.0) {
            return Ok(());
        }
        require(&self.name, "z", self.z.re(), |z| z > 1.0, "> 1 for a set with planet inertia")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let one = T::of(1.0);
        let row =
            m.row(&[(&self.sun, one), (&self.ring, self.z), (&self.carrier, -(self.z + 1.0))]);
        if let Some(inertia) = self.planet_inertia.filter(|_| self.z.re().decide(|z| z > 1.0)) {
            // ω_planet = ω_carrier - (ω_sun - ω_carrier) N_sun / N_planet, N_planet = (N_ring - N_sun)/2
            let pinion = (self.z - 1.0).recip() * 2.0;
            let spin = m.row(&[(&self.carrier, pinion + 1.0), (&self.sun, -pinion)]);
            m.inertias.push(Inertia { element: self.name.clone(), row: spin, inertia });
        }
        if let Some(losses) = &self.losses {
            let slip = m.row(&[(&self.sun, one), (&self.carrier, -one)]);
            m.add_loss(&self.name, slip, Some(m.constraints.len()), losses.map());
        }
        m.constraints.push(Constraint { element: self.name.clone(), row, loss: None });
    }
}
