// SPDX-License-Identifier: MIT
//! Exponential integrator: whole input samples of one mode by exact propagators.

pub(crate) mod fixed_step;
pub(crate) mod guard_plan;
pub(crate) mod guards;
pub(crate) mod phi;
pub(crate) mod plan;
pub(crate) mod propagator;
pub(crate) mod propagator_cache;
pub(crate) mod samples;
pub(crate) mod step;
