// SPDX-License-Identifier: MIT
//! A prescribed torque, such as a measured engine torque.

use crate::model::Name;
use crate::model::error::{ModelError, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Torque on one node from an input, N·m, positive with the speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Torque<T> {
    /// Unique name.
    pub name: Name,
    /// Node it acts on.
    pub node: Name,
    /// Name of the input.
    pub input: Name,
    /// The element has no number of its own.
    #[serde(skip)]
    pub number: PhantomData<T>,
}

impl<T: Number> Torque<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let law = ForceLaw::Input(m.input(&self.input));
        let node = m.node(&self.node);
        let (element, account) = (self.name.clone(), Account::Source);
        m.forces.push(Force { element, node, law, lag: None, account });
    }
}
