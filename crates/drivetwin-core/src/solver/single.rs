// SPDX-License-Identifier: MIT
//! Many samples in one mode by exact operators, while no guard comes near its fall.
//!
//! A sample in which a guard could fall is left to the Taylor expansion, which locates the event.

use crate::number::Real;
use crate::solver::exponential::fixed_step::{FixedSteps, step_samples};
use crate::solver::exponential::guards::StepState;
use crate::solver::exponential::plan::StepPlan;
use crate::solver::exponential::propagator::Propagator;
use crate::solver::exponential::propagator_cache::{MAX_STATES, SizedPropagator};
use crate::solver::exponential::samples::{
    BLOCK, ChannelState, DelayedInputs, InputSource, SampleBuffer, Samples, SharedInputs, room,
};
use crate::solver::inputs::SampleRange;
use crate::solver::integrator::Integrator;
use crate::solver::interrupt::is_interrupted;
use crate::solver::simd::{Kernel, dispatch_simd};
use crate::solver::status::Status;
use std::sync::Arc;

/// Consumer of the samples that fixed steps pass in one mode.
pub trait SampleSink<T: Real> {
    /// Most samples between calls of [`SampleSink::renew`].
    const SAMPLES: usize = BLOCK;

    /// Samples of a range with the channels `active`; see [`Samples`].
    fn write_block(
        &mut self,
        run: &Integrator<'_, T>,
        active: &[usize],
        samples: Samples<'_, T>,
        range: SampleRange,
    );

    /// Change the derivatives of the state `x` at a knot of the inputs, at `time` [s].
    fn renew(&mut self, time: f64, x: &mut [T]) {
        let _ = (time, x);
    }
}

/// Samples that a run without derivatives passes before it looks at their guards.
const SAMPLES_PER_CHECK: usize = 16;

impl<T: Real> Integrator<'_, T> {
    /// Advance over as many whole samples as possible, for as long as nobody interrupts.
    pub(crate) fn run_fixed_steps(&mut self, sink: &mut impl SampleSink<T>) -> Result<(), Status> {
        let mut passed = false;
        while let Some((plan, steps)) = self.plan_fixed_steps() {
            passed = true;
            let whole = self.run_block(&plan, steps, sink);
            if self.is_at_end() {
                return Ok(());
            }
            if is_interrupted() {
                return Err(Status::Interrupted { time: self.state.time() });
            }
            if !whole {
                break;
            }
        }
        if passed {
            self.load_inputs();
        }
        Ok(())
    }

    /// Pass samples of equal length; false where a guard could fall before their end.
    fn run_block(
        &mut self,
        plan: &StepPlan<T>,
        steps: FixedSteps,
        sink: &mut impl SampleSink<T>,
    ) -> bool {
        let active = &plan.active[..];
        match &plan.operators {
            SizedPropagator::Four(operators) => self.pass(operators, active, steps, sink),
            SizedPropagator::Eight(operators) => self.pass(operators, active, steps, sink),
            SizedPropagator::Twelve(operators) if !T::DERIVATIVES => {
                self.pass(operators, active, steps, sink)
            }
            SizedPropagator::Many(operators) if !T::DERIVATIVES => {
                self.pass(operators, active, steps, sink)
            }
            SizedPropagator::Most(operators) if !T::DERIVATIVES => {
                dispatch_simd(FixedStepRun::<_, _, MAX_STATES, 0> {
                    run: self,
                    operators,
                    active,
                    steps,
                    sink,
                })
            }
            _ => false,
        }
    }

    /// Plan fixed steps from the present sample on. Return the plan with its samples, None if fixed
    /// steps are not possible.
    fn plan_fixed_steps(&mut self) -> Option<(StepPlan<T>, FixedSteps)> {
        let (from, _) = self.inputs.span(self.segment);
        let h = self.inputs.usual_length(self.segment, self.settings.max_step)?;
        let plan = (self.state.t.re() == from)
            .then(|| self.state.plan_steps(&mut self.propagators, self.inputs.waves(), h))
            .flatten()?;
        let range =
            SampleRange { first: self.segment, count: self.inputs.equal_from(self.segment) };
        Some((plan, FixedSteps { range, h }))
    }

    /// Pass samples with operators of known size.
    fn pass<const N: usize>(
        &mut self,
        operators: &Propagator<T, N>,
        active: &[usize],
        steps: FixedSteps,
        sink: &mut impl SampleSink<T>,
    ) -> bool {
        let run = self;
        match operators.channels.len() {
            0 => dispatch_simd(FixedStepRun::<_, _, N, 0> { run, operators, active, steps, sink }),
            1 => dispatch_simd(FixedStepRun::<_, _, N, 1> { run, operators, active, steps, sink }),
            2 => dispatch_simd(FixedStepRun::<_, _, N, 2> { run, operators, active, steps, sink }),
            _ => dispatch_simd(FixedStepRun::<_, _, N, 4> { run, operators, active, steps, sink }),
        }
    }
}

/// Pass samples with the widest instructions, `A` channels at a time.
struct FixedStepRun<'r, 'a, T: Real, S, const N: usize, const A: usize> {
    run: &'r mut Integrator<'a, T>,
    operators: &'r Propagator<T, N>,
    active: &'r [usize],
    /// Samples to be passed.
    steps: FixedSteps,
    sink: &'r mut S,
}

impl<T: Real, S: SampleSink<T>, const N: usize, const A: usize> Kernel
    for FixedStepRun<'_, '_, T, S, N, A>
{
    type Output = bool;

    #[inline(always)]
    fn run<const F: bool>(self) -> bool {
        let inputs = Arc::clone(&self.run.inputs);
        if T::DERIVATIVES && inputs.jumps() {
            self.pass::<F, _>(&DelayedInputs(&inputs))
        } else {
            self.pass::<F, _>(&SharedInputs(&inputs))
        }
    }
}

impl<T: Real, S: SampleSink<T>, const N: usize, const A: usize> FixedStepRun<'_, '_, T, S, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: InputSource<T>>(self, source: &U) -> bool {
        let Self { run, operators, active, steps, sink } = self;
        let (h, mut count) = (steps.h, steps.range.count);
        let mut room = room();
        let first = source.read(run.segment, &mut room);
        let n = run.state.x.len();
        let mut x = [T::zero_(); N];
        x[..n].copy_from_slice(&run.state.x);
        let carry: [ChannelState<T>; A] = ChannelState::start::<F, N, A, _>(operators, first, &x);
        let guards = operators.guards::<_, F, A>(first, &x, &carry);
        let mut state = StepState { x, carry, guards };
        let mut trail = SampleBuffer::in_columns(std::mem::take(&mut run.trail), A);
        let mut whole = true;
        while count > 0 && whole && !is_interrupted() {
            let range = SampleRange { first: run.segment, count: count.min(S::SAMPLES) };
            let (steps, to) = (FixedSteps { range, h }, &mut trail);
            // Samples with derivatives are expensive, so guards are evaluated after each.
            let (passed, fallen) = if T::DERIVATIVES {
                step_samples::<U, T, F, N, A, 1>(operators, source, steps, &mut state, to, 0, 1)
            } else {
                step_samples::<U, T, F, N, A, SAMPLES_PER_CHECK>(
                    operators, source, steps, &mut state, to, 0, 1,
                )
            };
            sink.write_block(
                run,
                active,
                trail.samples(),
                SampleRange { first: run.segment, count: passed },
            );
            run.segment += passed;
            count -= passed;
            if fallen != 0 {
                state.x = std::array::from_fn(|i| trail.states(i)[passed]);
                whole = false;
            }
            if passed > 0 {
                sink.renew(run.inputs.knot(run.segment), &mut state.x[..n]);
            }
        }
        run.state.x.copy_from_slice(&state.x[..n]);
        run.state.t = T::of(run.inputs.knot(run.segment));
        if run.segment == run.inputs.segments() {
            trail.store(operators, 0, &state.x, &state.carry);
            sink.write_block(
                run,
                active,
                trail.samples(),
                SampleRange { first: run.segment, count: 1 },
            );
            run.segment -= 1;
        }
        run.trail = trail.into_columns();
        whole
    }
}
