// SPDX-License-Identifier: MIT
//! Accuracy settings of a run.

use crate::solver::tolerances::{
    AUDIT_PER_TRUNCATION, AUDIT_RTOL, TAYLOR_TOL, TAYLOR_TOL_BETWEEN_SAMPLES, ZERO_SLIP_RTOL,
};

/// Accuracy of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Truncation error allowed per step, relative to the states; [`TAYLOR_TOL_BETWEEN_SAMPLES`] at least where a run
    /// passes samples by operators.
    pub tolerance: f64,
    /// Longest step, s.
    pub max_step: f64,
    /// Fixed order instead of one that follows the tolerance, from 1 to below
    /// [`TERMS`](crate::number::TERMS); for convergence studies.
    pub order: Option<usize>,
    /// Pass samples without events by exact operators, with slipping torques as cubics in time:
    /// several times faster at an error of a few 1e-3 N·m on 1 ms samples.
    pub exponential_steps: bool,
}

impl Settings {
    /// Accuracy of Taylor steps, also between samples that propagators pass.
    pub(crate) fn accuracy(&self, uses_fixed_step: bool) -> Accuracy {
        let least = if uses_fixed_step { TAYLOR_TOL_BETWEEN_SAMPLES } else { 0.0 };
        Accuracy { tolerance: self.tolerance.max(least), order: self.order }
    }

    /// Speed that a run does not distinguish from zero, relative to the largest speed and 1 rad/s: a slip that counts
    /// as zero is removed, and a truncation error adds one.
    pub(crate) fn speed_resolution(&self) -> f64 {
        ZERO_SLIP_RTOL.max(self.tolerance)
    }

    /// Error of the energy balance that a completed run may have, J: relative to the largest `energy`, and of a run
    /// that hardly moves the energy that is `unresolved` because of [`Self::speed_resolution`].
    pub(crate) fn audit_tolerance(&self, energy: f64, unresolved: f64) -> f64 {
        let rtol = AUDIT_RTOL.max(self.tolerance * AUDIT_PER_TRUNCATION);
        (rtol * energy).max(unresolved)
    }

    /// Round-off accuracy throughout.
    pub fn exact() -> Self {
        Self { exponential_steps: false, ..Self::default() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tolerance: TAYLOR_TOL,
            max_step: f64::INFINITY,
            order: None,
            exponential_steps: true,
        }
    }
}

/// Accuracy of a Taylor step.
#[derive(Clone, Copy, Debug)]
pub struct Accuracy {
    /// Truncation error allowed per step, relative to `scale` of each state.
    pub tolerance: f64,
    /// Fixed order; with `None` the order follows from the tolerance.
    pub order: Option<usize>,
}

/// One step: the expansion of the integrator holds from `start` for `length` seconds.
#[derive(Clone, Copy, Debug)]
pub struct Step<T> {
    /// Start, s.
    pub start: T,
    /// Length, s; zero at coincident events.
    pub length: T,
}
