// SPDX-License-Identifier: MIT
//! An engine by its steady-state map over throttle and speed (paper eq. 2).

use crate::model::Name;
use crate::model::error::{ModelError, require, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::model::torque_map::TorqueMap;
use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Torque on one node from a map over a throttle input and the node's speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EngineMap<T> {
    /// Unique name.
    pub name: Name,
    /// Node of the crankshaft.
    pub node: Name,
    /// Name of the throttle input, 1.
    pub throttle: Name,
    /// Torque over throttle and speed.
    pub map: TorqueMap,
    /// Time constant with which the torque follows the map, s; at once if absent.
    #[serde(default = "Option::default")]
    pub lag: Option<T>,
}

impl<T: Number> EngineMap<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)?;
        if let Some(lag) = self.lag {
            require(&self.name, "lag", lag.re(), |v| v > 0.0, "> 0 s")?;
        }
        self.map.check(&self.name)
    }

    pub(crate) fn state_law(&self, m: &mut Mechanism<T>) {
        let node = m.node(&self.node);
        let law = ForceLaw::Map { input: m.input(&self.throttle), node, map: self.map.clone() };
        let (element, account) = (self.name.clone(), Account::Source);
        m.forces.push(Force {
            element,
            nodes: Mechanism::single(node),
            law,
            lag: self.lag,
            account,
        });
    }
}
