// SPDX-License-Identifier: MIT
//! Cache of the propagators of a network.

use crate::network::ModeKey;
use crate::solver::exponential::propagator::{MAX_ACTIVE, Propagator};
use std::collections::BTreeMap;
use std::sync::Arc;

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

/// Operators for the number of states at hand.
#[derive(Clone, Debug)]
pub(crate) enum SizedPropagator<T> {
    /// Up to 4.
    Four(Arc<Propagator<T, 4>>),
    /// Up to 8; of one run only.
    Eight(Arc<Propagator<T, 8>>),
    /// Up to 12; of plain numbers only.
    Twelve(Arc<Propagator<T, 12>>),
    /// Up to [`MANY`]; likewise.
    Many(Arc<Propagator<T, MANY>>),
    /// Up to [`MAX_STATES`]; likewise, and in linear modes only.
    Most(Arc<Propagator<T, MAX_STATES>>),
}

/// Most states of a network of plain numbers that is marched in modes with slipping elements.
pub(crate) const MANY: usize = 24;
/// Most states of a network of plain numbers that is marched.
pub(crate) const MAX_STATES: usize = 48;
