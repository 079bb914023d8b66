// SPDX-License-Identifier: MIT
//! A compliant shaft (paper eq. 8).

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart};
use crate::model::mechanism::{Mechanism, Spring, SpringLaw};
use crate::number::Number;

described! {
    /// Compliant shaft.
    ///
    /// `twist' = ω_a - ω_b`; torque `k · twist + c · twist'` on `b`, opposite on `a`.
    pub struct SpringDamper<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Driving end.
        pub a: Name = Node(),
        /// Driven end, or the ground.
        pub b: Name = Node(),
        /// Stiffness.
        pub stiffness: T = Number("N·m/rad").at_least(0.0),
        /// Damping.
        pub damping: T = Number("N·m·s/rad").at_least(0.0).preset(0.0),
    }
}

impl<T: Number> SpringDamper<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_apart(&self.name, &self.a, &self.b)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.a, T::of(1.0)), (&self.b, T::of(-1.0))]);
        let law = SpringLaw::Linear { stiffness: self.stiffness, damping: self.damping };
        m.springs.push(Spring { element: self.name.clone(), row, law });
    }
}
