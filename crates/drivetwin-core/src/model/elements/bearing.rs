// SPDX-License-Identifier: MIT
//! Dry and viscous friction of a bearing.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::friction::{FrictionLaw, FrictionTable};
use crate::model::mechanism::{Friction, Mechanism, Normal};
use crate::number::Number;

described! {
    /// Dry and viscous friction of a bearing.
    ///
    /// Torque against the relative speed of `a` and `b` from a table over its magnitude; at rest up to
    /// `peak` times the first value is held.
    pub struct Bearing<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Shaft.
        pub a: Name = Node(),
        /// Housing, as a rule the ground.
        pub b: Name = Node().grounded(),
        /// Relative speed, increasing from 0; the last piece goes on beyond the table.
        pub speed: Vec<f64> = Axis("rad/s").at_least(0.0),
        /// Friction torque at each speed.
        pub torque: Vec<T> = Numbers("N·m").at_least(0.0),
        /// Static over kinetic torque at rest.
        pub peak: T = Number().at_least(1.0).preset(1.0),
    }
}

impl<T: Number> Bearing<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)?;
        self.law().check(&self.name)
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
