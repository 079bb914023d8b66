// SPDX-License-Identifier: MIT
//! A tyre whose force grows linearly with its longitudinal slip, without relaxation.

use crate::model::Name;
use crate::model::error::{ModelError, require, require_apart, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Torque `slip_stiffness · (ω_a - ω_b) / max(|ω_b|, least_speed)` on `b`, opposite on `a`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tyre<T> {
    /// Unique name.
    pub name: Name,
    /// Rim.
    pub a: Name,
    /// Vehicle, its speed over the rolling radius.
    pub b: Name,
    /// Torque over slip, N·m. Must be > 0.
    pub slip_stiffness: T,
    /// Speed of `b` below which the torque is that of a damper, rad/s. Must be > 0.
    pub least_speed: f64,
}

impl<T: Number> Tyre<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require_moving(&self.name, &self.a)?;
        require_moving(&self.name, &self.b)?;
        require(&self.name, "slip_stiffness", self.slip_stiffness.re(), |v| v > 0.0, "> 0 N m")?;
        require(&self.name, "least_speed", self.least_speed, |v| v > 0.0, "> 0 rad/s")
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let (wheel, road) = (m.node(&self.a), m.node(&self.b));
        let least_speed = self.least_speed;
        for (node, stiffness) in [(wheel, -self.slip_stiffness), (road, self.slip_stiffness)] {
            let law = ForceLaw::Slip { wheel, road, stiffness, least_speed };
            let (element, account) = (self.name.clone(), Account::Converter);
            m.forces.push(Force {
                element,
                nodes: Mechanism::single(node),
                law,
                lag: None,
                account,
            });
        }
    }
}
