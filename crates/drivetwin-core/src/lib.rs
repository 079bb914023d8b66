// SPDX-License-Identifier: MIT
//! Driveline mechanisms with set-valued friction.
//!
//! The folders are the pipeline: [`model`] describes, [`network`] compiles to minimal coordinates,
//! [`solver`] integrates with exact events, [`control`] commands by slip, [`simulate`] turns scenarios into
//! trajectories.
//! SI `f64` throughout; equations and signs as in `docs/theory.md`.

pub mod control;
pub mod model;
pub mod network;
pub mod number;
pub mod simulate;
pub mod solver;
