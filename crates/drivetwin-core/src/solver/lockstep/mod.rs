// SPDX-License-Identifier: MIT
//! SIMD lockstep execution: several runs of one network in the lanes of vectors.

pub(crate) mod batch;
pub(crate) mod fixed_step;
pub(crate) mod inputs;
pub(crate) mod lane;
