// SPDX-License-Identifier: MIT
//! A node that is driven at a given speed whatever torque that takes.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_moving};
use crate::model::mechanism::{Mechanism, Prescribed};
use crate::number::Number;
use std::marker::PhantomData;

described! {
    /// Node that is driven at a given speed, whatever torque that takes.
    ///
    /// `ω_node` equals an input. A friction element that would have to hold against it slips.
    pub struct PrescribedSpeed<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node it drives.
        pub node: Name = Node(),
        /// Speed input, which must not jump.
        pub input: Name = Input("rad/s"),
        /// The element has no number of its own.
        #[serde(skip)]
        pub number: PhantomData<T> = Hidden(),
    }
}

impl<T: Number> PrescribedSpeed<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let (node, input) = (m.node(&self.node), m.input(&self.input));
        m.prescribed.push(Prescribed { element: self.name.clone(), node, input });
    }
}
