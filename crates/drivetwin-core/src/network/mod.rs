// SPDX-License-Identifier: MIT
//! 2 The compiled mechanism: minimal coordinates, mass matrix, friction rows, modes.
//!
//! State `x = (v, z, y)`: independent speeds, twists, lagging torques. In one mode (which friction
//! elements and gears are stuck, which way power flows through lossy gears)
//!
//! ```text
//! x' = D · b      τ_stuck = T · b      λ = L · b      b = (x, u, prescribed accelerations, 1, φ)
//! ```
//!
//! with inputs u and scalar channels φ: the torque of every slipping friction element and of every
//! force law that is not linear.

pub mod cell;
pub mod channel;
mod compile;
mod constraints;
pub mod engaged;
mod error;
mod hold;
pub mod linalg;
mod mode;
mod radius;
pub mod reduction;
pub mod smooth;
pub mod statics;

pub use cell::Cell;
pub use channel::Channel;
pub use compile::{FrictionRow, LossyGear, Network};
pub use error::CompileError;
pub(crate) use hold::Hold;
pub use mode::{GearBounds, GearState, Mode, ModeKey, Row};
