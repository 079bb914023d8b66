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

mod branch;
mod compile;
mod constraint_forces;
mod constraints;
mod error;
mod impulse;
pub mod linalg;
pub mod loss_coupling;
mod massless;
pub mod mobility;
mod mode;
pub mod nonlinear_torque;
mod port_torque;
pub mod reduction;
pub mod smooth_law;
mod spectral_radius;
pub mod statics;
mod table_loss;

pub use branch::Branch;
pub use compile::{FrictionElement, LossyGear, Network};
pub use constraints::SpeedForm;
pub use error::CompileError;
pub use impulse::{Demand, Impulse, ImpulseFault};
pub use mode::{GearBounds, GearState, Mode, ModeKey, RowId};
pub use nonlinear_torque::NonlinearTorque;
pub use table_loss::TableLoss;
