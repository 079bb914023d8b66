// SPDX-License-Identifier: MIT
//! A tyre whose force grows linearly with its longitudinal slip, without relaxation.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;

described! {
    /// Tyre whose force grows linearly with its longitudinal slip, without relaxation.
    ///
    /// Torque `slip_stiffness · (ω_a - ω_b) / max(|ω_b|, least_speed)` on `b`, opposite on `a`.
    pub struct Tyre<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Rim.
        pub a: Name = Node(),
        /// Vehicle; its speed is that over the rolling radius.
        pub b: Name = Node(),
        /// Torque over slip.
        pub slip_stiffness: T = Number("N·m").above(0.0),
        /// Speed of `b` below which the torque is that of a damper.
        pub least_speed: f64 = Constant("rad/s").above(0.0).preset(0.5),
    }
}

impl<T: Number> Tyre<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        require_moving(&self.name, &self.a)?;
        require_moving(&self.name, &self.b)
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
