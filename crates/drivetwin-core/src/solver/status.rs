// SPDX-License-Identifier: MIT
//! Outcome of a run, as a value.

use std::fmt;

/// Outcome of a run. Everything but `Completed` names the time [s] and, where one is to blame, the
/// element.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// Reached the end.
    Completed,
    /// One element changed its friction mode again and again at one instant.
    Chattering {
        /// Time, s.
        time: f64,
        /// Name of the element.
        element: String,
    },
    /// No assignment of sticking and slipping satisfies the friction laws.
    Undecidable {
        /// Time, s.
        time: f64,
        /// A member of the conflict.
        element: String,
    },
    /// A lossy gear leaves the accelerations undetermined.
    SelfLocking {
        /// Time, s.
        time: f64,
        /// Name of the element.
        element: String,
    },
    /// The step became too small for the arithmetic.
    StepTooSmall {
        /// Time, s.
        time: f64,
    },
    /// A state is no longer finite.
    NotFinite {
        /// Time, s.
        time: f64,
    },
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Completed => write!(f, "completed"),
            Self::Chattering { time, element } => {
                write!(f, "chattering of {element} at {time:.9} s")
            }
            Self::Undecidable { time, element } => {
                write!(f, "no consistent friction state at {time:.9} s, {element} among others")
            }
            Self::SelfLocking { time, element } => {
                write!(f, "{element} is self-locking at {time:.9} s")
            }
            Self::StepTooSmall { time } => write!(f, "step too small at {time:.9} s"),
            Self::NotFinite { time } => write!(f, "state not finite at {time:.9} s"),
        }
    }
}
