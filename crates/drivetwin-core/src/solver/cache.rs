// SPDX-License-Identifier: MIT
//! Everything that runs of one network share: its modes and its propagators.

use crate::network::Network;
use crate::solver::exponential::propagator_cache::PropagatorCache;
use crate::solver::hybrid::mode_cache::ModeCache;

/// A network with the modes and propagators that earlier runs have compiled. Both depend on the
/// network alone, so the result of a run does not depend on the contents of the cache.
#[derive(Clone, Debug)]
pub struct SolverCache<'n, T> {
    /// The network.
    pub network: &'n Network<T>,
    pub(crate) modes: ModeCache<T>,
    pub(crate) propagators: PropagatorCache<T>,
}

impl<'n, T> SolverCache<'n, T> {
    /// Create an empty cache of a network.
    pub fn new(network: &'n Network<T>) -> Self {
        Self { network, modes: ModeCache::new(), propagators: PropagatorCache::new() }
    }
}
