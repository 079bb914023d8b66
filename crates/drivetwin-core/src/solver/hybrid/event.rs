// SPDX-License-Identifier: MIT
//! Events of the hybrid system: causes, kinds and friction states.

use crate::network::{Branch, RowId};
use crate::number::{SimdVector, Values};

/// Cause of an event: the guard that crossed zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EventCause {
    /// The slip of a friction element, or the speed of a lossy gear, reaches zero.
    SlipZero(RowId),
    /// The normal load of an element sets in or is gone.
    LoadOnset(usize),
    /// The torque of a row at rest leaves its bounds; its sign.
    TorqueLimit(RowId, f64),
    /// Torque limit reached within round-off of a knot of the inputs, where the inputs may end.
    TorqueLimitAtKnot(RowId),
    /// Power through a rolling gear changes its direction.
    PowerReversal(usize),
    /// A channel enters another branch.
    BranchBoundary(usize, Branch),
    /// Events at one instant did not come to an end; everything is decided anew a moment later.
    Stalled,
}

impl EventCause {
    /// Return the cause for an event at a knot of the inputs.
    pub fn move_to_knot(self) -> Self {
        match self {
            Self::TorqueLimit(row, _) => Self::TorqueLimitAtKnot(row),
            other => other,
        }
    }
}

/// Friction mode of one element (paper eqs. 4-6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrictionState {
    /// No capacity.
    Open,
    /// Slip in one direction.
    Slipping {
        /// Sign of the slip and of the torque.
        sign: f64,
    },
    /// No slip, torque within the static capacity.
    Sticking,
    /// No slip because other elements hold the same speeds; torque at the static capacity.
    Saturated {
        /// Sign of the torque.
        sign: f64,
    },
}

impl FrictionState {
    /// Return true for an element at its capacity whose zero speed other elements hold.
    pub(crate) fn is_saturated(&self) -> bool {
        matches!(self, Self::Saturated { .. })
    }
}

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Slip came to rest.
    Lock,
    /// The holding torque exceeded the static capacity.
    BreakAway,
    /// Slip passed through zero.
    Reverse,
    /// The pressure rose above the fill pressure.
    ClutchFilled,
    /// The pressure fell below the fill pressure.
    ClutchVented,
    /// The impulse at the start of the run lost energy in the element.
    Impulse,
}

/// A change of friction mode.
#[derive(Clone, Debug)]
pub struct Event<T> {
    /// Time, s; carries derivatives.
    pub time: T,
    /// Index of the friction element, after these of the lossy gear, after these of the prescribed speed.
    pub element: usize,
    /// Kind of the change.
    pub kind: EventKind,
    /// Energy lost in an impulse, J; zero for other kinds.
    pub energy: T,
}

impl<const K: usize> Event<SimdVector<K>> {
    /// Return the event of one lane.
    pub(crate) fn extract_run(&self, run: usize) -> Event<f64> {
        Event {
            time: self.time.0[run],
            element: self.element,
            kind: self.kind,
            energy: self.energy.0[run],
        }
    }
}

/// Sign with zero counted as positive.
pub(crate) fn signum_nonneg<V: Values>(value: V) -> f64 {
    value.decide(|value| if value < 0.0 { -1.0 } else { 1.0 })
}
