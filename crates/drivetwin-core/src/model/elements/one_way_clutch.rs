// SPDX-License-Identifier: MIT
//! A one-way clutch (freewheel), with a friction clutch beside it where a pressure is named.

use crate::model::Name;
use crate::model::error::{ModelError, require, require_apart};
use crate::model::friction::FrictionLaw;
use crate::model::mechanism::{Friction, Mechanism, Normal};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// `a` can drive `b` forward with any torque and cannot overrun it: slip `ω_a - ω_b ≤ 0`.
/// Against the free direction acts the clutch's capacity, none without pressure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OneWayClutch<T> {
    /// Unique name.
    pub name: Name,
    /// Driving side.
    pub a: Name,
    /// Driven side, or the ground.
    pub b: Name,
    /// The parallel clutch, none if absent.
    #[serde(default = "Option::default")]
    pub clutch: Option<ParallelClutch<T>>,
}

/// The clutch beside a freewheel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParallelClutch<T> {
    /// μ over |slip|.
    pub friction: FrictionLaw<T>,
    /// N·D·A·r, m³. Must be >= 0.
    pub gain: T,
    /// Pressure at which the fill ends, Pa.
    pub p0: T,
    /// Static over kinetic capacity at zero slip. Must be >= 1.
    pub peak: T,
    /// Name of the pressure input, Pa.
    pub pressure: Name,
}

impl<T: Number> OneWayClutch<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        let Some(clutch) = &self.clutch else { return Ok(()) };
        clutch.friction.check(&self.name)?;
        require(&self.name, "gain", clutch.gain.re(), |v| v >= 0.0, ">= 0 m^3")?;
        require(&self.name, "p0", clutch.p0.re(), |_| true, "finite")?;
        require(&self.name, "peak", clutch.peak.re(), |v| v >= 1.0, ">= 1")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let (law, normal, peak) = match &self.clutch {
            Some(c) => {
                let input = m.input(&c.pressure);
                (c.friction.clone(), Normal::Pressure { input, gain: c.gain, p0: c.p0 }, c.peak)
            }
            None => (FrictionLaw::constant(T::of(1.0)), Normal::Constant(T::zero_()), T::of(1.0)),
        };
        let element = self.name.clone();
        m.frictions.push(Friction { element, row, law, normal, peak, one_way: true });
    }
}
