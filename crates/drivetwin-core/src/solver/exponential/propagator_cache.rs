// SPDX-License-Identifier: MIT
//! Cache of the propagators of a network.

use crate::network::ModeKey;
use crate::solver::exponential::propagator::{MAX_ACTIVE, SizedPropagator};
use std::collections::BTreeMap;

/// Key of a propagator: mode, active channels with their branches, and step length.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct PropagatorKey {
    pub mode: ModeKey,
    /// Bits of the active channels, of their directions, and of what is watched or pressed.
    pub branches: [u64; 3],
    pub pieces: [u8; MAX_ACTIVE],
    /// Bits of angular frequency and offset of the inputs that are waves.
    pub waves: Vec<Option<[u64; 2]>>,
    /// Step length, ps: times that differ by round-off share their operators.
    pub step: u64,
}

/// Propagators by key. An entry is `None` where a step is too long for its mode.
#[derive(Clone, Debug)]
pub(crate) struct PropagatorCache<T> {
    pub entries: BTreeMap<PropagatorKey, Option<SizedPropagator<T>>>,
}

impl<T> PropagatorCache<T> {
    /// Create an empty cache.
    pub(crate) fn new() -> Self {
        Self { entries: BTreeMap::new() }
    }
}
