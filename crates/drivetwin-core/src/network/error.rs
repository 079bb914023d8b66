// SPDX-License-Identifier: MIT
//! Reason why a mechanism cannot be compiled.

use crate::model::ModelFaults;
use thiserror::Error;

/// Fault of a mechanism as a whole, naming its elements or members.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CompileError {
    /// The elements themselves are faulty.
    #[error(transparent)]
    Model(#[from] ModelFaults),
    /// Rigid couplings that repeat or contradict each other.
    #[error(
        "the rigid couplings of {} depend on each other; remove one of them or put a compliance \
         between them",
        elements.join(", ")
    )]
    DependentConstraints {
        /// Elements whose rows are linearly dependent.
        elements: Vec<String>,
    },
    /// A member has no inertia and nothing determines its acceleration.
    #[error(
        "nothing determines the acceleration of {}: give one of these members an inertia or a \
         rigid connection to one that has it",
        members.join(", ")
    )]
    Massless {
        /// Nodes that move in the undetermined direction.
        members: Vec<String>,
    },
    /// Prescribed speeds that determine each other.
    #[error(
        "the prescribed speeds of {} determine each other through rigid couplings; keep one",
        elements.join(", ")
    )]
    PrescribedTwice {
        /// The elements.
        elements: Vec<String>,
    },
    /// Everything is rigidly connected to the ground, or ratios between the same nodes contradict each other.
    #[error(
        "the mechanism cannot move: the rigid couplings of {} leave no independent speed",
        elements.join(", ")
    )]
    Immobile {
        /// The rigid couplings.
        elements: Vec<String>,
    },
    /// More friction elements and lossy gears than a mode key can hold.
    #[error("{count} friction elements and lossy gears; at most {limit} are supported")]
    TooManyRows {
        /// Number found.
        count: usize,
        /// Number supported.
        limit: usize,
    },
}
