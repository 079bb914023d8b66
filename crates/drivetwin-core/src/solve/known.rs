// SPDX-License-Identifier: MIT
//! What runs of a network have compiled: modes and step operators.

use super::ready::{AnySize, Key};
use crate::network::{Mode, ModeKey, Network};
use crate::number::Number;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A network with the modes and step operators that its runs have needed so far, for those that follow.
/// They depend on nothing but the network, so that a run does not change with what is known.
#[derive(Clone, Debug)]
pub struct Known<'n, T> {
    /// The network.
    pub network: &'n Network<T>,
    /// Modes, but for those that depend on capacities.
    modes: BTreeMap<ModeKey, Arc<Mode<T>>>,
    /// Step operators; none where a step is too long for its mode.
    pub(super) operators: BTreeMap<Key, Option<AnySize<T>>>,
}

impl<'n, T> Known<'n, T> {
    /// Nothing but the network.
    pub fn of(network: &'n Network<T>) -> Self {
        Self { network, modes: BTreeMap::new(), operators: BTreeMap::new() }
    }
}

impl<T: Number> Known<'_, T> {
    /// A mode that runs have needed.
    pub(super) fn known_mode(&self, key: ModeKey) -> Option<Arc<Mode<T>>> {
        self.modes.get(&key).map(Arc::clone)
    }

    /// A mode that is compiled; `capacities` weigh the torque split of redundant locks. `None` if the
    /// efficiencies leave the accelerations undetermined.
    pub(super) fn new_mode(&mut self, key: ModeKey, capacities: &[T]) -> Option<Arc<Mode<T>>> {
        let mode = Arc::new(self.network.mode(key, capacities)?);
        if !mode.redundant {
            self.modes.insert(key, Arc::clone(&mode));
        }
        Some(mode)
    }
}
