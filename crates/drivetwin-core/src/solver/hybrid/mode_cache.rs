// SPDX-License-Identifier: MIT
//! Cache of the compiled modes of a network.

use crate::network::{Mode, ModeKey, Network};
use crate::number::Number;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Compiled modes, except those that depend on capacities.
#[derive(Clone, Debug)]
pub(crate) struct ModeCache<T> {
    modes: BTreeMap<ModeKey, Arc<Mode<T>>>,
}

impl<T> ModeCache<T> {
    /// Create an empty cache.
    pub(crate) fn new() -> Self {
        Self { modes: BTreeMap::new() }
    }
}

impl<T: Number> ModeCache<T> {
    /// Return a mode that has been compiled before.
    pub(crate) fn cached_mode(&self, key: ModeKey) -> Option<Arc<Mode<T>>> {
        self.modes.get(&key).map(Arc::clone)
    }

    /// Compile a mode; `capacities` weigh the torque split of redundant locks. Return `None` if the
    /// efficiencies leave the accelerations undetermined.
    pub(crate) fn compile_mode(
        &mut self,
        network: &Network<T>,
        key: ModeKey,
        capacities: &[T],
    ) -> Option<Arc<Mode<T>>> {
        let mode = Arc::new(network.mode(key, capacities)?);
        if !mode.redundant {
            self.modes.insert(key, Arc::clone(&mode));
        }
        Some(mode)
    }
}
