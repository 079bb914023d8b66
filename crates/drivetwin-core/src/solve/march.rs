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

use super::operators::{Carried, Operators};
use super::step::{over_channels, step};
use super::watch::Guards;
use crate::network::smooth::{MAX_INPUTS, Sample, Value};
use crate::number::{FOUR, Factor, Lane, Values};

/// Samples that are passed before they are handed on.
pub const BLOCK: usize = 64;

/// Inputs of one run or several.
pub trait Source<L: Lane> {
    /// Plain numbers, or where runs have inputs of their own or a delay is a parameter, numbers like the
    /// state. With derivatives these jump between segments.
    type Input: Factor<L, Values: Factor<L::Values>>;

    /// The inputs of a segment, in `room` where they stand nowhere.
    fn read<'s>(
        &'s self,
        segment: usize,
        room: &'s mut Room<Self::Input>,
    ) -> &'s Sample<Self::Input>;

    /// The least and the largest value of an input over `count` segments from `first` on, or bounds of
    /// these.
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [L::Values; 2];
}

/// Room for the inputs of a segment.
pub type Room<U> = [[U; 2]; MAX_INPUTS];

/// [`Room`] without inputs.
#[inline(always)]
pub fn room<U: Lane>() -> Room<U> {
    [[U::all(0.0); 2]; MAX_INPUTS]
}

/// What a line, value and rate, comes to after `h` [s], without derivatives.
#[inline(always)]
fn line_end<U: Lane>([start, rate]: [U; 2], h: f64) -> U::Values {
    rate.values().times(h) + start.values()
}

/// A carried channel at the start of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Carry<L> {
    /// Argument.
    pub argument: L,
    /// Its rate over a sample.
    pub rate: L,
    /// Torque with its slopes.
    pub value: Value<L>,
    /// Argument expected at the end of the sample.
    pub near: L,
    /// Stiction there.
    pub stiction: L,
}

/// States and torques of the carried channels at the start of passed samples, and at the end of the last,
/// each as a column over the samples: first the states.
pub struct Trail<L, const N: usize>(Vec<Column<L>>);

/// One value at every sample, in whole fours.
pub type Column<L> = [L; BLOCK + FOUR];

/// States and torques of the active channels at the start of samples, at least of those passed.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'s, L> {
    /// By state.
    pub states: &'s [Column<L>],
    /// By the number of the active channel.
    pub torques: &'s [Column<L>],
}

impl<L: Lane, const N: usize> Trail<L, N> {
    /// For so many carried channels, in columns of old.
    pub fn in_columns(mut columns: Vec<Column<L>>, channels: usize) -> Self {
        if columns.len() < N + channels {
            columns.resize(N + channels, [L::all(0.0); BLOCK + FOUR]);
        }
        Self(columns)
    }

    /// What has been set.
    pub fn samples(&self) -> Samples<'_, L> {
        let (states, torques) = self.0.split_at(N);
        Samples { states, torques }
    }

    /// The columns, for another trail.
    pub fn into_columns(self) -> Vec<Column<L>> {
        self.0
    }

    /// Set sample `k`.
    #[inline(always)]
    pub fn put<const A: usize>(
        &mut self,
        op: &Operators<L, N>,
        k: usize,
        (x, carry): (&[L; N], &[Carry<L>; A]),
    ) {
        let (states, torques) = self.0.split_first_chunk_mut::<N>().expect("a column by state");
        for i in 0..op.columns() {
            states[i][k] = x[i];
        }
        for a in 0..A {
            torques[a][k] = op.channels[a].torque(&carry[a]);
        }
    }

    /// State `i`.
    #[inline(always)]
    pub fn states(&self, i: usize) -> &Column<L> {
        &self.0[i]
    }

    /// Torque of the carried channel number `slot`.
    #[inline(always)]
    pub fn torques(&self, slot: usize) -> &Column<L> {
        &self.0[N + slot]
    }
}

/// Pass up to `count` samples from segment `first`, which stand in the trail from place `at` on. Returns how
/// many were passed and, as bits, the runs of which a guard could have fallen within the next one. Only the
/// runs `live`, as bits, count.
///
/// Guards are looked at over `W` samples together, which run ahead of them: with `W = 1` state and carry
/// are those after the sample that was not passed, else the trail alone knows where that began.
#[inline(always)]
pub fn march<
    S: Source<L>,
    L: Lane,
    const F: bool,
    const N: usize,
    const A: usize,
    const W: usize,
>(
    op: &Operators<L, N>,
    (source, h): (&S, f64),
    (first, count): (usize, usize),
    (state, carried, guards): (&mut [L; N], &mut [Carry<L>; A], &mut Guards<L::Values>),
    (trail, at, live): (&mut Trail<L, N>, usize, u32),
) -> (usize, u32) {
    let mut room = room();
    // Of its own, for the processor's registers.
    let (mut x, mut carry) = (*state, *carried);
    let mut outcome = (count, 0);
    let loaded = op.stays_loaded::<S, F>(source, (first, count));
    let looks = !loaded || !op.watched.is_empty();
    trail.put(op, at, (&x, &carry));
    'samples: for from in (0..count).step_by(W) {
        let some = W.min(count - from);
        let (mut fallen, mut left) = ([L::Values::all(0.0); W], [L::Values::all(0.0); W]);
        for (k, fallen) in fallen.iter_mut().enumerate().take(some) {
            let u = source.read(first + from + k, &mut room);
            if S::Input::DERIVATIVES {
                carry = Carry::start::<F, N, A, _>(op, u, &x);
                trail.put(op, at + from + k, (&x, &carry));
            }
            *fallen = step::<L, _, F, N, A>(op, (u, h), (&mut x, &mut carry));
            trail.put(op, at + from + k + 1, (&x, &carry));
            if W == 1 {
                let end = |i: usize| line_end(u[i], h);
                left[k] = op.leaves::<_, F, A>(guards, (end, !loaded), (&x, &carry));
            }
        }
        if W > 1 && looks {
            let to = (&*trail, at + from, some);
            // Apart, which leaves the step the processor's registers.
            let ends = |input| ends_of(source, input, (first + from, some), h);
            left = op.left::<_, F, A, W>(guards, (ends, !loaded), to);
        }
        for k in 0..some {
            let fallen = fallen[k].negative_with(left[k]);
            if fallen.any_negative() && fallen.negative() & live != 0 {
                outcome = (from + k, fallen.negative() & live);
                break 'samples;
            }
        }
    }
    (*state, *carried) = (x, carry);
    // What has grown beyond all bounds is left to the expansion, which says so.
    let sum = x.iter().fold(L::Values::all(0.0), |sum, x| x.values().magnitude() + sum);
    match (outcome.1, sum.unbounded() & live) {
        (0, unbounded) if unbounded != 0 => (count.saturating_sub(1), unbounded),
        _ => outcome,
    }
}

/// An input at the ends of samples of length `h` [s], `count` of at most `W` from segment `first` on, without
/// derivatives.
#[inline(always)]
fn ends_of<L: Lane, S: Source<L>, const W: usize>(
    source: &S,
    input: usize,
    (first, count): (usize, usize),
    h: f64,
) -> [<S::Input as Lane>::Values; W] {
    let (mut room, mut ends) = (room(), [Lane::all(0.0); W]);
    for (k, end) in ends.iter_mut().enumerate().take(count) {
        *end = line_end(source.read(first + k, &mut room)[input], h);
    }
    ends
}

impl<L: Lane> Carry<L> {
    /// Nothing carried.
    pub fn idle() -> Self {
        let none = L::all(0.0);
        Self { argument: none, rate: none, value: Value::zero(), near: none, stiction: none }
    }

    /// Those of another in the runs named by bits.
    #[inline(always)]
    pub fn with(&self, runs: u32, other: &Self) -> Self {
        let (own, value) = (&self.value, &other.value);
        Self {
            argument: self.argument.with(runs, other.argument),
            rate: self.rate.with(runs, other.rate),
            value: Value {
                value: own.value.with(runs, value.value),
                by_argument: own.by_argument.with(runs, value.by_argument),
                bend: own.bend.with(runs, value.bend),
                by_normal: own.by_normal.with(runs, value.by_normal),
                mixed: own.mixed.with(runs, value.mixed),
            },
            near: self.near.with(runs, other.near),
            stiction: self.stiction.with(runs, other.stiction),
        }
    }

    /// All channels at the start of a segment.
    #[inline(always)]
    pub fn start<const F: bool, const N: usize, const A: usize, U: Factor<L>>(
        op: &Operators<L, N>,
        sample: &Sample<U>,
        x: &[L; N],
    ) -> [Self; A] {
        let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
        let mut out = [Self::idle(); A];
        for a in 0..A {
            let Carried { argument, law, .. } = &channels[a];
            for i in 0..op.columns() {
                out[a].argument = argument[i].fma::<F>(x[i], out[a].argument);
            }
            let m = out[a].argument;
            let normal = law.normal.start::<F, U>(sample);
            out[a].value = law.about::<F>(m, law.stiction::<F>(m)).here(normal);
        }
        for a in 0..A {
            let form = &channels[a].rate;
            let mut rate = over_channels::<L, F, N, A>(form, &out, form.constant);
            for i in 0..op.columns() {
                rate = form.state[i].fma::<F>(x[i], rate);
            }
            for drive in &op.drives {
                rate = sample[drive.input][0].onto::<F>(drive.now[a], rate);
            }
            out[a].rate = rate;
            out[a].near = rate + out[a].argument;
            out[a].stiction = channels[a].law.stiction::<F>(out[a].near);
        }
        out
    }
}

impl<L: Lane, const N: usize> Carried<L, N> {
    /// Its torque φ.
    #[inline(always)]
    pub fn torque(&self, carry: &Carry<L>) -> L {
        self.law.sign * carry.value.value
    }
}
