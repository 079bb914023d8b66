// SPDX-License-Identifier: MIT
//! A rotating mass.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_moving};
use crate::model::mechanism::{self, Mechanism};
use crate::number::Number;

described! {
    /// Inertia on one node.
    ///
    /// `inertia · ω' = Σ torques`. Several inertias on one node add up.
    pub struct Inertia<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node it turns with.
        pub node: Name = Node(),
        /// Inertia.
        pub inertia: T = Number("kg·m²").at_least(0.0),
    }
}

impl<T: Number> Inertia<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let row = m.row(&[(&self.node, T::of(1.0))]);
        let (element, inertia) = (self.name.clone(), self.inertia);
        m.inertias.push(mechanism::Inertia { element, row, inertia });
    }
}
