// SPDX-License-Identifier: MIT
//! 2 The compiled mechanism: minimal coordinates, mass matrix, friction rows, modes.
//!
//! State `x = (v, z)`: independent speeds and twists. In one mode (which friction elements are
//! stuck, which way power flows through lossy gears)
//!
//! ```text
//! x' = D · (x, u, 1, φ)      τ_stuck = T · (x, u, 1, φ)      λ = L · (x, u, 1, φ)
//! ```
//!
//! with inputs u and scalar channels φ: the torque of every slipping friction element and of every
//! force law that is not linear.

pub mod channel;
mod compile;
mod constraints;
mod error;
pub mod linalg;
mod mode;

pub use channel::{Cell, Channel};
pub use compile::{FrictionRow, LossyGear, Network};
pub use error::CompileError;
pub use mode::{Mode, ModeKey};
