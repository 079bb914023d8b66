// SPDX-License-Identifier: MIT
//! Sample after sample in one mode, for one run or several side by side.
//!
//! The torque φ of a slipping element is a cubic in time over a sample, through value and rate at both
//! ends. Its argument at the end is predicted with the second derivative of φ at the start, which
//! leaves an error of fourth order; the cubic through the predicted end corrects it, the law is moved
//! to the corrected argument by its own derivatives, and the state at the end follows from the torque
//! that it gives there. One exponential a sample and channel, grown from the last a sample ahead, at about
//! the argument that it is needed at, so that nothing waits for it; with derivatives, where products count
//! for more, at the predicted argument itself.

use crate::number::{KernelFloat, Values};
use crate::solver::exponential::guards::StepState;
use crate::solver::exponential::propagator::Propagator;
use crate::solver::exponential::samples::{
    ChannelState, InputSource, SampleBuffer, line_end, room,
};
use crate::solver::exponential::step::step;
use crate::solver::inputs::SampleRange;

/// Samples of equal length.
#[derive(Clone, Copy, Debug)]
pub struct FixedSteps {
    /// Samples.
    pub range: SampleRange,
    /// Length of each, s.
    pub h: f64,
}

/// Pass up to as many samples as `steps` has and store them in the trail from place `at` on. Returns how
/// many were passed and, as bits, the runs of which a guard could have fallen within the next one. Only the
/// runs `live`, as bits, count.
///
/// Guards are evaluated over `W` samples together, after these samples were computed. With `W = 1`, state
/// and carry are those after the sample that was not passed. With larger `W`, only the trail contains the
/// start of that sample.
#[inline(always)]
pub fn step_samples<
    S: InputSource<L>,
    L: KernelFloat,
    const F: bool,
    const N: usize,
    const A: usize,
    const W: usize,
>(
    op: &Propagator<L, N>,
    source: &S,
    steps: FixedSteps,
    state: &mut StepState<L, N, A>,
    trail: &mut SampleBuffer<L, N>,
    at: usize,
    live: u32,
) -> (usize, u32) {
    let FixedSteps { range, h } = steps;
    let SampleRange { first, count } = range;
    let mut room = room();
    // Of its own, for the processor's registers.
    let (mut x, mut carry) = (state.x, state.carry);
    let mut outcome = (count, 0);
    let loaded = op.stays_loaded::<S, F>(source, range);
    let looks = !loaded || !op.guards.is_empty();
    trail.store(op, at, &x, &carry);
    'samples: for from in (0..count).step_by(W) {
        let some = W.min(count - from);
        let (mut fallen, mut left) = ([L::Values::splat(0.0); W], [L::Values::splat(0.0); W]);
        for (k, fallen) in fallen.iter_mut().enumerate().take(some) {
            let u = source.read(first + from + k, &mut room);
            if S::Input::DERIVATIVES {
                carry = ChannelState::start::<F, N, A, _>(op, u, &x);
                trail.store(op, at + from + k, &x, &carry);
            }
            *fallen = step::<L, _, F, N, A>(op, u, h, &mut x, &mut carry);
            trail.store(op, at + from + k + 1, &x, &carry);
            if W == 1 {
                let end = |i: usize| line_end(u[i], h);
                left[k] = op.crossed::<_, F, A>(&mut state.guards, end, !loaded, &x, &carry);
            }
        }
        if W > 1 && looks {
            // Apart, which leaves the step the processor's registers.
            let ends = |input| ends_of(source, input, first + from, some, h);
            left = op.crossed_in_block::<_, F, A, W>(
                &mut state.guards,
                ends,
                !loaded,
                trail,
                at + from,
                some,
            );
        }
        for k in 0..some {
            let fallen = fallen[k].either_negative(left[k]);
            if fallen.any_negative() && fallen.negative_mask() & live != 0 {
                outcome = (from + k, fallen.negative_mask() & live);
                break 'samples;
            }
        }
    }
    (state.x, state.carry) = (x, carry);
    // Unbounded states are left to the expansion, which returns the error.
    let sum = x.iter().fold(L::Values::splat(0.0), |sum, x| x.values().magnitude() + sum);
    match (outcome.1, sum.nonfinite_mask() & live) {
        (0, unbounded) if unbounded != 0 => (count.saturating_sub(1), unbounded),
        _ => outcome,
    }
}

/// An input at the ends of samples of length `h` [s], `count` of at most `W` from segment `first` on, without
/// derivatives.
#[inline(always)]
fn ends_of<L: KernelFloat, S: InputSource<L>, const W: usize>(
    source: &S,
    input: usize,
    first: usize,
    count: usize,
    h: f64,
) -> [<S::Input as KernelFloat>::Values; W] {
    let (mut room, mut ends) = (room(), [KernelFloat::splat(0.0); W]);
    for (k, end) in ends.iter_mut().enumerate().take(count) {
        *end = line_end(source.read(first + k, &mut room)[input], h);
    }
    ends
}
