// SPDX-License-Identifier: MIT
//! Many samples in one mode by exact operators, while no guard comes near its fall.
//!
//! A sample in which a guard could fall is left to the Taylor expansion, which locates the event.

use super::inputs::Inputs;
use super::integrator::Integrator;
use super::lanes::{Task, dispatch};
use super::march::{BLOCK, Carry, Room, Samples, Source, Trail, march, room};
use super::operators::Operators;
use super::ready::{AnySize, Ready};
use crate::network::smooth::Sample;
use crate::number::Real;

/// Takes samples that were passed in one mode.
pub trait Sink<T: Real> {
    /// Samples `(first, count)` with the channels `active`; see [`Samples`].
    fn passed(
        &mut self,
        run: &Integrator<'_, T>,
        active: &[usize],
        samples: Samples<'_, T>,
        range: (usize, usize),
    );
}

/// Samples that a run without derivatives passes before it looks at their guards.
const AHEAD: usize = 16;

impl<T: Real> Integrator<'_, T> {
    /// Advance over as many whole samples as possible.
    pub(super) fn sprint(&mut self, sink: &mut impl Sink<T>) {
        let mut passed = false;
        while let Some((ready, steps)) = self.ready_to_sprint() {
            passed = true;
            if !self.pass_stretch(&ready, steps, sink) || self.is_at_end() {
                break;
            }
        }
        if passed && !self.is_at_end() {
            self.take_inputs();
        }
    }

    /// Pass samples of equal length, `steps` [s] and their number; false where a guard could fall before
    /// their end.
    fn pass_stretch(
        &mut self,
        ready: &Ready<T>,
        steps: (f64, usize),
        sink: &mut impl Sink<T>,
    ) -> bool {
        let active = &ready.active[..];
        match &ready.operators {
            AnySize::Four(operators) => self.pass(operators, active, steps, sink),
            AnySize::Eight(operators) => self.pass(operators, active, steps, sink),
            AnySize::Twelve(operators) if !T::DERIVATIVES => {
                self.pass(operators, active, steps, sink)
            }
            AnySize::Many(operators) if !T::DERIVATIVES => {
                self.pass(operators, active, steps, sink)
            }
            AnySize::Twelve(_) | AnySize::Many(_) => false,
        }
    }

    /// What a sprint from here on needs, if one is possible: with the length [s] and number of its samples.
    fn ready_to_sprint(&mut self) -> Option<(Ready<T>, (f64, usize))> {
        let (from, _) = self.inputs.span(self.segment);
        let h = self.inputs.usual_length(self.segment, self.settings.max_step)?;
        let ready = (self.regime.t.re() == from).then(|| self.regime.ready(h)).flatten()?;
        Some((ready, (h, self.inputs.equal_from(self.segment))))
    }

    /// Pass samples with operators of known size.
    fn pass<const N: usize>(
        &mut self,
        operators: &Operators<T, N>,
        active: &[usize],
        steps: (f64, usize),
        sink: &mut impl Sink<T>,
    ) -> bool {
        let run = self;
        match operators.channels.len() {
            0 => dispatch(Sprint::<_, _, N, 0> { run, operators, active, steps, sink }),
            1 => dispatch(Sprint::<_, _, N, 1> { run, operators, active, steps, sink }),
            2 => dispatch(Sprint::<_, _, N, 2> { run, operators, active, steps, sink }),
            _ => dispatch(Sprint::<_, _, N, 4> { run, operators, active, steps, sink }),
        }
    }
}

/// Pass samples with the widest instructions, `A` channels at a time.
struct Sprint<'r, 'a, T: Real, S, const N: usize, const A: usize> {
    run: &'r mut Integrator<'a, T>,
    operators: &'r Operators<T, N>,
    active: &'r [usize],
    /// Step length [s] and number of samples.
    steps: (f64, usize),
    sink: &'r mut S,
}

impl<T: Real, S: Sink<T>, const N: usize, const A: usize> Task for Sprint<'_, '_, T, S, N, A> {
    type Output = bool;

    #[inline(always)]
    fn run<const F: bool>(self) -> bool {
        let inputs = self.run.inputs;
        if T::DERIVATIVES && inputs.jumps() {
            self.pass::<F, _>(&Shifted(inputs))
        } else {
            self.pass::<F, _>(&Lines(inputs))
        }
    }
}

impl<T: Real, S: Sink<T>, const N: usize, const A: usize> Sprint<'_, '_, T, S, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: Source<T>>(self, source: &U) -> bool {
        let Self { run, operators, active, steps: (h, mut count), sink } = self;
        let mut room = room();
        let first = source.read(run.segment, &mut room);
        let n = run.regime.x.len();
        let mut x = [T::zero_(); N];
        x[..n].copy_from_slice(&run.regime.x);
        let mut carry: [Carry<T>; A] = Carry::start::<F, N, A, _>(operators, first, &x);
        let mut guards = operators.guards::<_, F, A>(first, (&x, &carry));
        let mut trail = Trail::in_columns(std::mem::take(&mut run.trail), A);
        let mut whole = true;
        while count > 0 && whole {
            let samples = (run.segment, count.min(BLOCK));
            let at = (&mut x, &mut carry, &mut guards);
            // Samples with derivatives are dear.
            let to = (&mut trail, 0, 1);
            let (passed, fallen) = if T::DERIVATIVES {
                march::<U, T, F, N, A, 1>(operators, (source, h), samples, at, to)
            } else {
                march::<U, T, F, N, A, AHEAD>(operators, (source, h), samples, at, to)
            };
            sink.passed(run, active, trail.samples(), (run.segment, passed));
            run.segment += passed;
            count -= passed;
            if fallen != 0 {
                x = std::array::from_fn(|i| trail.states(i)[passed]);
                whole = false;
            }
        }
        run.regime.x.copy_from_slice(&x[..n]);
        run.regime.t = T::of(run.inputs.knot(run.segment));
        if run.segment == run.inputs.segments() {
            trail.put(operators, 0, (&x, &carry));
            sink.passed(run, active, trail.samples(), (run.segment, 1));
            run.segment -= 1;
        }
        run.trail = trail.into_columns();
        whole
    }
}

/// The inputs of one run.
pub(super) struct Lines<'a, T>(pub &'a Inputs<T>);

impl<T: Real> Source<T> for Lines<'_, T> {
    type Input = f64;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, _: &'s mut Room<f64>) -> &'s Sample<f64> {
        self.0.lines(segment)
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}

/// The inputs of one run where a delay is a parameter.
struct Shifted<'a, T>(&'a Inputs<T>);

impl<T: Real> Source<T> for Shifted<'_, T> {
    type Input = T;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut Room<T>) -> &'s Sample<T> {
        for (to, line) in room.iter_mut().zip(self.0.lines_at(segment)) {
            *to = line;
        }
        &room[..self.0.lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}
