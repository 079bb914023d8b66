// SPDX-License-Identifier: MIT
//! Tolerances of the solver: every threshold that separates a quantity from round-off, and every
//! bound of an approximation error.
//!
//! `RTOL` is relative to the scale named in the comment, `ATOL` is absolute in the unit named there.

use crate::number::{Number, Values};

// Friction decisions.

/// Zero of a sum, relative to the sum of the magnitudes of its terms. Well above `1e-16` times the
/// number of terms of a driveline.
pub(crate) const SUM_RTOL: f64 = 1e-10;
/// Excess of a holding torque over its bound that is round-off, relative to the sum of all holding
/// torques.
pub(crate) const BOUND_RTOL: f64 = 1e-14;
/// Torque without meaning, N·m: load of gears and freewheels at rest after all motion has decayed.
/// Far below any sensor resolution.
pub(crate) const TORQUE_ATOL: f64 = 1e-7;
/// Margin to the bounds that a lasting hold needs, relative to the torque held.
pub(crate) const STRICT_MARGIN_RTOL: f64 = 1e-9;
/// Slip acceleration without meaning, rad/s²: the remainder where all torques pass through zero.
pub(crate) const ACCELERATION_ATOL: f64 = 1e-9;
/// Acceleration of an element at rest that is round-off, relative to 1 rad/s² plus the largest
/// prescribed acceleration.
pub(crate) const FORCED_ACCELERATION_RTOL: f64 = 1e-9;
/// Acceleration of an element at rest that is round-off, relative to the sum of the magnitudes of its terms.
pub(crate) const FORCED_SUM_RTOL: f64 = 1e-13;
/// Slip of an element at rest by which a prescribed speed has moved it, relative to the largest of its
/// terms and 1 rad/s.
pub(crate) const FORCED_SLIP_RTOL: f64 = 1e-10;
/// Distance of the one-sided limit t⁺ from an event, s. Rates decide there where values agree.
pub(crate) const T_PLUS: f64 = 1e-10;
/// Largest distance of t⁺, relative to the rest of the input segment.
pub(crate) const T_PLUS_SHARE: f64 = 1e-4;
/// Largest change of a state up to t⁺, relative to its size and 1: light members move within less than
/// [`T_PLUS`].
pub(crate) const T_PLUS_CHANGE: f64 = 1e-4;
/// Slip that counts as zero, relative to the largest of its terms and 1 rad/s.
pub(crate) const ZERO_SLIP_RTOL: f64 = 1e-11;

// Mode transitions.

/// Speed of an initially locked element that is round-off of the start state, relative to its fastest
/// member and [`SPEED_FLOOR`].
pub(crate) const START_SPEED_RTOL: f64 = 1e-9;
/// Speed of members that counts as none beside their round-off, rad/s.
pub(crate) const SPEED_FLOOR: f64 = 1e-3;
/// Change of the kinetic energy by an impulse that only removes round-off, relative to this energy.
pub(crate) const JUMP_ENERGY_RTOL: f64 = 1e-8;
/// Speed of a member without mass that nothing holds, relative to 1 rad/s plus the fastest other member.
pub(crate) const RUNAWAY: f64 = 1e4;
/// Error of the energy balance of a run, relative to its largest energy.
pub(crate) const AUDIT_RTOL: f64 = 1e-8;
/// Error of the energy balance per truncation error of a step, where a larger one is asked for.
pub(crate) const AUDIT_PER_TRUNCATION: f64 = 1e4;
/// Slip that a stalled run can have gained within [`STALL_NUDGE`], rad/s.
pub(crate) const STALLED_SLIP: f64 = 1e-6;
/// Time before the end of a normal load within which the load counts as gone, s.
pub(crate) const VENT_TIME: f64 = 1e-11;

// Event search.

/// Zero of a guard polynomial, relative to the sum of the magnitudes of its terms over the step.
pub(crate) const GUARD_RTOL: f64 = 1e-13;
/// Depth below zero of a grazing guard, relative to its size. The event time of such a guard has no
/// usable derivative.
pub(crate) const GRAZING_RTOL: f64 = 1e-6;
/// Slip rate of a released element that is round-off, relative to the next Taylor term, 1/s.
pub(crate) const RELEASE_RATE_RTOL: f64 = 1e-9;
/// Largest slip rate that can be such, relative to the sum of the magnitudes of its terms.
pub(crate) const RELEASE_SUM_RTOL: f64 = 1e-6;

// Stall detection.

/// Step lost in round-off, relative to 1 s plus the end time.
pub(crate) const TIME_RTOL: f64 = 1e-14;
/// Step that counts as no advance, relative to 1 s plus the time.
pub(crate) const ADVANCE_RTOL: f64 = 1e-13;
/// Least advance over a window of events, s. Less is Zeno behaviour.
pub(crate) const MIN_ADVANCE_OF_EVENTS: f64 = 1e-7;
/// Least advance over a window of steps, s. Less means a motion that is too stiff or diverges.
pub(crate) const MIN_ADVANCE_OF_STEPS: f64 = 1e-3;
/// Time by which a stalled run is moved on, s.
pub(crate) const STALL_NUDGE: f64 = 1e-10;

// Taylor expansion.

/// Default truncation error per step, relative to the scale of each state.
pub(crate) const TAYLOR_TOL: f64 = 1e-12;
/// Least truncation tolerance of steps between samples that are passed by propagators, whose own
/// error is larger.
pub(crate) const TAYLOR_TOL_BETWEEN_SAMPLES: f64 = 1e-8;
/// Largest change of the stiction exponent within a step. The series of the exponential then
/// decreases from its second term on.
pub(crate) const MAX_STICTION_EXPONENT_CHANGE: f64 = 2.0;
/// Slip beyond which stiction is zero, in Stribeck speeds: `exp(-40)` is below round-off.
pub(crate) const STICTION_RANGE: f64 = 40.0;

// Collocation.

/// Change of the states at the nodes by a Newton iteration that counts as converged, relative to their
/// scales.
pub(crate) const COLLOCATION_RTOL: f64 = 1e-12;
/// Largest growth exponent, within an implicit step, of a slip that its own torque drives.
pub(crate) const MAX_COLLOCATION_GROWTH: f64 = 0.5;

// Exponential integrator.

/// Truncation error of the series of the phi-functions, relative to the first term. Small, because
/// the matrix is badly scaled.
pub(crate) const SERIES_RTOL: f64 = 1e-24;
/// Largest `ρ(A) h` for which a cubic approximates the torque of a slipping element.
pub const MAX_SPECTRAL_STEP_SLIPPING: f64 = 0.7;
/// Largest `ρ(A) h` for which the series of the propagator is summed directly.
pub(crate) const MAX_SPECTRAL_STEP_LINEAR: f64 = 3.0;
/// Largest cubic part of a channel torque over a sample, relative to the largest channel torque plus
/// 1 N·m.
pub(crate) const CUBIC_RTOL: f64 = 2e-4;
/// Largest change of a channel torque by the corrector, relative to the same scale.
pub(crate) const CORRECTION_RTOL: f64 = 3e-6;
/// Largest distance over which stiction is expanded, in Stribeck speeds.
pub(crate) const MAX_LINEARIZED_DISTANCE: f64 = 0.05;
/// Least deviation of a guarded torque from its chord within a sample, relative to its rise.
pub(crate) const MIN_CHORD_DEVIATION_OF_RISE: f64 = 0.05;
/// Least deviation of a guarded torque from its chord within a sample, relative to its size.
pub(crate) const MIN_CHORD_DEVIATION_OF_SIZE: f64 = 0.005;

/// Acceleration [rad/s²] without meaning, of the size `scale` of the terms that it is the sum of.
pub(crate) fn negligible(scale: f64) -> f64 {
    SUM_RTOL * scale + ACCELERATION_ATOL
}

/// Real part of the scalar product, and sum of the magnitudes of its terms. The sum is the scale of the
/// round-off.
pub(crate) fn sum_and_scale<T: Number>(row: &[T], basis: &[T]) -> (T::Values, T::Values) {
    let none = T::Values::zero_();
    row.iter().zip(basis).fold((none, none), |(sum, scale), (a, b)| {
        let term = a.re() * b.re();
        (sum + term, scale + term.magnitude())
    })
}
