// SPDX-License-Identifier: MIT
//! A prescribed torque, such as a measured engine torque or that of a motor between two shafts.

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_apart, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::number::Number;
use std::marker::PhantomData;

described! {
    /// Prescribed torque, such as a measured engine torque or that of a motor between two shafts.
    ///
    /// Torque on a node from an input, N·m, positive with the speed; another node may take the reaction.
    pub struct Torque<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node it acts on.
        pub node: Name = Node(),
        /// Node that takes the opposite torque, as of a motor between two shafts.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub reaction: Option<Name> = Node().absent("from outside"),
        /// Torque input.
        pub input: Name = Input("N·m"),
        /// The element has no number of its own.
        #[serde(skip)]
        pub number: PhantomData<T> = Hidden(),
    }
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
