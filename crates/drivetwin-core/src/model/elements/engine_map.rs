// SPDX-License-Identifier: MIT
//! An engine by its steady-state map over throttle and speed (paper eq. 2).

use crate::model::Name;
use crate::model::declare::described;
use crate::model::error::{ModelError, require_moving};
use crate::model::mechanism::{Account, Force, ForceLaw, Mechanism};
use crate::model::torque_map::TorqueMap;
use crate::number::Number;

described! {
    /// Engine by its steady-state map over throttle and speed.
    ///
    /// Torque on one node from a map over a throttle input and the speed of the node. With a lag it follows
    /// the map by `lag · T' = map - T`, from T = 0 at the start.
    pub struct EngineMap<T> {
        /// Unique name.
        pub name: Name = Name(),
        /// Node of the crankshaft.
        pub node: Name = Node(),
        /// Throttle input.
        pub throttle: Name = Input(),
        /// Torque over throttle and speed.
        pub map: TorqueMap = Group(),
        /// Time constant with which the torque follows the map.
        pub lag: Option<T> = Number("s").above(0.0).absent("none"),
    }
}

impl<T: Number> EngineMap<T> {
    pub(crate) fn check(&self) -> Result<(), ModelError> {
        require_moving(&self.name, &self.node)?;
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
