// SPDX-License-Identifier: MIT
//! A prescribed torque, such as a measured engine torque or that of a motor between two shafts.

use crate::model::Name;
use crate::model::error::{ModelError, require_apart, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Torque on a node from an input, N·m, positive with the speed; another node may take the reaction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Torque<T> {
    /// Unique name.
    pub name: Name,
    /// Node it acts on.
    pub node: Name,
    /// Node that takes the opposite torque; the ground or none for a torque from outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reaction: Option<Name>,
    /// Name of the input.
    pub input: Name,
    /// The element has no number of its own.
    #[serde(skip)]
    pub number: PhantomData<T>,
}

impl<T: Number> Torque<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)?;
        match &self.reaction {
            Some(reaction) => require_apart(&self.name, &self.node, reaction),
            None => Ok(()),
        }
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let law = ForceLaw::Input(m.input(&self.input));
        let mut nodes = Mechanism::single(m.node(&self.node));
        if let Some(reaction) = &self.reaction {
            nodes.extend(m.row(&[(reaction, T::of(-1.0))]));
        }
        let (element, account) = (self.name.clone(), Account::Source);
        m.forces.push(Force { element, nodes, law, lag: None, account });
    }
}
