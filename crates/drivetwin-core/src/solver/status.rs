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
    /// A one-way clutch blocks a motion that cannot be stopped.
    Blocked {
        /// Time, s.
        time: f64,
        /// Name of the one-way clutch.
        element: String,
        /// Prescribed speeds and other elements that demand the motion.
        with: Vec<String>,
    },
    /// Inertias of too different size leave the motion undetermined.
    Undetermined {
        /// Time, s.
        time: f64,
        /// Members.
        members: Vec<String>,
    },
    /// An impulse on elements does not close the energy balance, or takes energy where their slip is round-off.
    Unbalanced {
        /// Time, s.
        time: f64,
        /// Elements brought to rest, then prescribed speeds.
        elements: Vec<String>,
        /// Error of the balance, J.
        error: f64,
        /// Energy of the members, J.
        energy: f64,
    },
    /// The energy balance of the run does not close.
    OpenBalance {
        /// Time, s.
        time: f64,
        /// Error of the balance, J.
        error: f64,
        /// Largest energy of the run, J.
        energy: f64,
    },
    /// The torque on a member without mass exceeds what its friction elements take.
    Runaway {
        /// Time, s.
        time: f64,
        /// The member.
        member: String,
    },
    /// The caller asked for the end.
    Interrupted {
        /// Time, s.
        time: f64,
    },
    /// The step became too small for the arithmetic.
    StepTooSmall {
        /// Time, s.
        time: f64,
    },
    /// A point of the grid has no value although the run reached its end.
    Unrecorded {
        /// Time of the point, s.
        time: f64,
    },
    /// A state is no longer finite.
    NotFinite {
        /// Time, s.
        time: f64,
    },
    /// A controller gave a command that is not finite.
    CommandNotFinite {
        /// Time of the task, s.
        time: f64,
        /// Quantities that the controller measured.
        measured: String,
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
            Self::Blocked { time, element, with } => write!(
                f,
                "{element} blocks at {time:.9} s the motion that comes from {}; reverse {element}, \
                 change the prescribed speed or release a lock",
                with.join(", ")
            ),
            Self::Undetermined { time, members } => write!(
                f,
                "the inertias leave the motion of {} undetermined at {time:.9} s; they differ \
                 by too many decades",
                members.join(", ")
            ),
            Self::Unbalanced { time, elements, error, energy } => write!(
                f,
                "locking {} at {time:.9} s changes the kinetic energy of {energy:.3e} J by \
                 {error:.3e} J that nothing accounts for; ratios nearly cancel, or inertias differ by \
                 too many decades",
                elements.join(", ")
            ),
            Self::OpenBalance { time, error, energy } => write!(
                f,
                "the energy balance misses {error:.3e} J of {energy:.3e} J at {time:.9} s; inertias or \
                 stiffnesses differ by too many decades"
            ),
            Self::Runaway { time, member } => write!(
                f,
                "the torque on {member}, which has no inertia, exceeds what its clutches take before \
                 {time:.9} s; give {member} an inertia"
            ),
            Self::Interrupted { time } => write!(f, "interrupted at {time:.9} s"),
            Self::StepTooSmall { time } => write!(f, "step too small at {time:.9} s"),
            Self::Unrecorded { time } => write!(f, "no value was recorded at {time:.9} s"),
            Self::NotFinite { time } => write!(f, "state not finite at {time:.9} s"),
            Self::CommandNotFinite { time, measured } => {
                write!(f, "the controller's command is not finite at {time:.9} s ({measured})")
            }
        }
    }
}
