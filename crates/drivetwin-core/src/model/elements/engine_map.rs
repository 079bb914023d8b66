// SPDX-License-Identifier: MIT
//! An engine by its steady-state map over throttle and speed (paper eq. 2).

use crate::model::error::ModelError;
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::model::torque_map::TorqueMap;
use crate::number::Real;
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;

/// Torque on one node from a map over a throttle input and the node's speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EngineMap<T> {
    /// Unique name.
    pub name: String,
    /// Node of the crankshaft.
    pub node: String,
    /// Name of the throttle input, 1.
    pub throttle: String,
    /// Torque over throttle and speed.
    pub map: TorqueMap,
    /// The map is data, not a number with derivatives.
    #[serde(skip)]
    pub number: PhantomData<T>,
}

impl<T: Real> EngineMap<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        self.map.check(&self.name)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let law = ForceLaw::Map { input: m.input(&self.throttle), map: self.map.clone() };
        let node = m.node(&self.node);
        let account = Account::Source;
        m.forces.push(Force { element: self.name.clone(), node, law, account });
    }
}
