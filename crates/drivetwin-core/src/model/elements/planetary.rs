// SPDX-License-Identifier: MIT
//! A planetary gear set.

use crate::model::declare::described;
use crate::model::error::{ModelError, require};
use crate::model::mechanism::{Constraint, Inertia, Mechanism};
use crate::model::{LossTable, Name};
use crate::number::{Number, Values};

described! {
    /// Planetary gear set.
    ///
    /// `ω_sun + z ω_ring = (1 + z) ω_carrier` with z = teeth of ring over teeth of sun (Willis).
    pub struct Planetary<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node of the sun.
        pub sun: Name = Node(),
        /// Node of the ring.
        pub ring: Name = Node(),
        /// Node of the carrier.
        pub carrier: Name = Node(),
        /// Teeth of the ring over teeth of the sun; negative for a dual-pinion set.
        pub z: T = Number().not(&[0.0, -1.0]),
        /// Spin inertia of all planets together about their own axes. Only a set with single pinions (z > 1)
        /// may have one. The orbiting mass of the planets belongs to the carrier.
        pub planet_inertia: Option<T> = Number("kg·m²").at_least(0.0).absent("0"),
        /// Loss torque between sun and carrier over their relative speed and the torque that enters at the
        /// sun.
        pub losses: Option<LossTable> = Group().absent("no loss"),
    }
}

impl<T: Number> Planetary<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        self.losses.as_ref().map_or(Ok(()), |losses| losses.check(&self.name))?;
        let Some(spin) = self.planet_inertia else { return Ok(()) };
        if spin.re().decide(|v| v == 0.0) {
            return Ok(());
        }
        require(&self.name, "z", self.z.re(), |z| z > 1.0, &"> 1 for a set with planet inertia")
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
