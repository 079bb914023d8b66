// SPDX-License-Identifier: MIT
//! Sample after sample in one mode, for one run or several side by side.
//!
//! The torque φ of a slipping element is a cubic in time over a sample, through value and rate at both
//! ends. Its argument at the end is predicted with the second derivative of φ at the start, which
//! leaves an error of fourth order; the cubic through the predicted end corrects it, and the law is
//! moved to the corrected argument by its own derivatives. One exponential a sample and channel, taken
//! a sample ahead at about the argument that it is needed at, so that nothing waits for it.

use super::operators::{Carried, MAX_ACTIVE, MAX_WATCHED, Operators, Watched};
use super::step::{over_channels, step};
use crate::network::smooth::{Line, MAX_INPUTS, Sample, Value, input_of};
use crate::number::{Lane, Pack, Values};

/// Samples that are passed before they are handed on.
pub const BLOCK: usize = 64;

/// Inputs of one run or several.
pub trait Source<L> {
    /// Fill in the inputs of a segment.
    fn read(&self, segment: usize, sample: &mut Sample<L>);

    /// The least and the largest value of an input over `count` segments from `first` on, or bounds of
    /// these.
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [L::Values; 2]
    where
        L: Lane;

    /// The inputs of a segment.
    #[inline(always)]
    fn sample(&self, segment: usize) -> Sample<L>
    where
        L: Lane,
    {
        let mut sample = [[L::all(0.0); 2]; MAX_INPUTS];
        self.read(segment, &mut sample);
        sample
    }
}

/// Carried channels at the start of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Carry<L, const A: usize> {
    /// Arguments.
    pub argument: [L; A],
    /// Their rates.
    pub rate: [L; A],
    /// Torques with their slopes.
    pub value: [Value<L>; A],
    /// Arguments expected at the end of the sample.
    pub near: [L; A],
    /// Stiction there.
    pub stiction: [L; A],
}

/// Limits and values of the watched forms at the start of a sample.
pub type Guards<V> = [[V; 2]; MAX_WATCHED];

/// Of what is not watched.
pub fn idle_guards<V: Values>() -> Guards<V> {
    [[V::all(1.0), V::all(0.0)]; MAX_WATCHED]
}

/// Passed samples: states and carried torques at the start of each.
pub struct Trail<L, const N: usize> {
    /// States.
    pub states: Vec<[L; N]>,
    /// Torques of the carried channels.
    pub torques: Vec<[L; MAX_ACTIVE]>,
}

impl<L: Lane, const N: usize> Trail<L, N> {
    /// Room for so many samples, at most [`BLOCK`].
    pub fn with_room(samples: usize) -> Self {
        let room = samples.min(BLOCK);
        Self { states: Vec::with_capacity(room), torques: Vec::with_capacity(room) }
    }

    /// Add a sample.
    #[inline(always)]
    pub fn push<const A: usize>(&mut self, op: &Operators<L, N>, x: &[L; N], carry: &Carry<L, A>) {
        self.states.push(*x);
        self.torques.push(carry.torques(op));
    }

    /// Forget all samples.
    pub fn clear(&mut self) {
        self.states.clear();
        self.torques.clear();
    }
}

/// Pass up to `count` (at most [`BLOCK`]) samples from segment `first`. Returns how many were passed
/// and, as bits, the runs of which a guard could have fallen within the next one. State and carry are
/// those after that sample all the same; its start stands in the trail. Only the runs `live`, as bits,
/// count.
#[inline(always)]
pub fn march<L: Lane, const F: bool, const N: usize, const A: usize>(
    op: &Operators<L, N>,
    (source, h): (&impl Source<L>, f64),
    (first, count): (usize, usize),
    (x, carry, guards): (&mut [L; N], &mut Carry<L, A>, &mut Guards<L::Values>),
    (trail, live): (&mut Trail<L, N>, u32),
) -> (usize, u32) {
    trail.clear();
    let mut u = [[L::all(0.0); 2]; MAX_INPUTS];
    let loaded = op.loads.iter().all(|load| {
        let bounds = source.bounds(load.input, (first, count));
        op.stays_loaded::<F>(load, bounds)
    });
    for k in 0..count {
        source.read(first + k, &mut u);
        if L::DERIVATIVES {
            *carry = Carry::start::<F, N>(op, (&u, h), x);
        }
        trail.push(op, x, carry);
        let mut guard = step::<L, F, N, A>(op, (&u, h), (x, carry));
        for (place, before) in guards.iter_mut().enumerate().take(op.watched.len()) {
            let after = op.guard::<F, A>(place, (&u, h), (x, carry));
            guard = guard.negative_with(op.falls(place, (*before, after)));
            *before = after;
        }
        if !loaded {
            for load in &op.loads {
                guard = guard.negative_with(op.unloads::<F>(load, (&u, h)));
            }
        }
        let fallen = guard.negative() & live;
        if fallen != 0 {
            return (k, fallen);
        }
    }
    // What has grown beyond all bounds is left to the expansion, which says so.
    let sum = x.iter().fold(L::Values::all(0.0), |sum, x| x.values().magnitude() + sum);
    match sum.unbounded() & live {
        0 => (count, 0),
        unbounded => (count.saturating_sub(1), unbounded),
    }
}

impl<L: Lane, const N: usize> Operators<L, N> {
    /// All guards at the start of a segment.
    #[inline(always)]
    pub fn guards<const F: bool, const A: usize>(
        &self,
        sample: &Sample<L>,
        at: (&[L; N], &Carry<L, A>),
    ) -> Guards<L::Values> {
        let mut guards = idle_guards();
        for (place, guard) in guards.iter_mut().enumerate().take(self.watched.len()) {
            *guard = self.guard::<F, A>(place, (sample, 0.0), at);
        }
        guards
    }

    /// Whether a load stays above zero in all runs while its input stays within bounds.
    #[inline(always)]
    fn stays_loaded<const F: bool>(&self, load: &Line<L>, bounds: [L::Values; 2]) -> bool {
        let (gain, offset) = (load.gain.values(), load.offset.values());
        let [low, high] = bounds.map(|u| -gain.fma::<F>(u, offset));
        // Above zero where its negative is below.
        low.negative() & high.negative() == L::Values::all(-1.0).negative()
    }

    /// Something negative where a load falls below zero within a sample.
    #[inline(always)]
    fn unloads<const F: bool>(&self, load: &Line<L>, (sample, h): (&Sample<L>, f64)) -> L::Values {
        let [before, rate] = load.line::<F>(sample).map(Lane::values);
        // A load of -0 is none that has fallen.
        let none = L::Values::all(0.0);
        (before + none).negative_with(rate.times(h) + before + none)
    }

    /// Limit and value of a watched form `elapsed` seconds into a segment.
    #[inline(always)]
    fn guard<const F: bool, const A: usize>(
        &self,
        place: usize,
        (sample, elapsed): (&Sample<L>, f64),
        (x, carry): (&[L; N], &Carry<L, A>),
    ) -> [L::Values; 2] {
        let Watched { form, limit, .. } = &self.watched[place];
        let mut torque = form.constant.values();
        for drive in &self.drives {
            let [start, rate] = input_of(sample, drive.input);
            let u = rate.values().times(elapsed) + start.values();
            torque = drive.watched[place].values().fma::<F>(u, torque);
        }
        for i in 0..self.columns() {
            torque = form.state[i].values().fma::<F>(x[i].values(), torque);
        }
        for a in 0..A {
            torque = form.channels[a].values().fma::<F>(carry.value[a].value.values(), torque);
        }
        let [start, rate] = limit.line::<F>(sample);
        [rate.values().times(elapsed) + start.values(), torque]
    }

    /// Something negative where a watched form may leave its limits within a sample, by these at both
    /// ends.
    #[inline(always)]
    fn falls(&self, place: usize, (before, after): ([L::Values; 2], [L::Values; 2])) -> L::Values {
        let side = self.watched[place].side.values();
        let rise = (after[1] - before[1]).magnitude();
        let size = before[1].magnitude().larger(after[1].magnitude());
        let bow = self.bow[0].values() * rise + self.bow[1].values() * size;
        let falls = |[limit, value]: [L::Values; 2]| {
            let left = limit - bow;
            (left - side * value).negative_with(left + value)
        };
        falls(before).negative_with(falls(after))
    }
}

impl<L: Lane, const A: usize> Carry<L, A> {
    /// Nothing carried.
    pub fn zero() -> Self {
        let none = L::all(0.0);
        Self {
            argument: [none; A],
            rate: [none; A],
            value: [Value::zero(); A],
            near: [none; A],
            stiction: [none; A],
        }
    }

    /// The torques.
    #[inline(always)]
    pub fn torques<const N: usize>(&self, op: &Operators<L, N>) -> [L; MAX_ACTIVE] {
        let mut torques = [L::all(0.0); MAX_ACTIVE];
        for a in 0..A {
            torques[a] = op.channels[a].law.sign * self.value[a].value;
        }
        torques
    }

    /// Everything at the start of a segment of length `h`.
    #[inline(always)]
    pub fn start<const F: bool, const N: usize>(
        op: &Operators<L, N>,
        (sample, h): (&Sample<L>, f64),
        x: &[L; N],
    ) -> Self {
        let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
        let mut out = Self::zero();
        for a in 0..A {
            let Carried { argument, law, .. } = &channels[a];
            for i in 0..op.columns() {
                out.argument[a] = argument[i].fma::<F>(x[i], out.argument[a]);
            }
            let m = out.argument[a];
            let normal = law.normal.line::<F>(sample)[0];
            out.value[a] = law.about::<F>(m, law.stiction::<F>(m)).here(normal);
        }
        for a in 0..A {
            let form = &channels[a].rate;
            let mut rate = over_channels::<L, F, N, A>(form, &out.value, form.constant);
            for i in 0..op.columns() {
                rate = form.state[i].fma::<F>(x[i], rate);
            }
            for drive in &op.drives {
                rate = drive.now[a].fma::<F>(input_of(sample, drive.input)[0], rate);
            }
            out.rate[a] = rate;
            out.near[a] = rate.times(h) + out.argument[a];
            out.stiction[a] = channels[a].law.stiction::<F>(out.near[a]);
        }
        out
    }
}

impl<const K: usize> Carry<Pack<K>, MAX_ACTIVE> {
    /// The first `A` channels.
    #[inline(always)]
    pub fn first<const A: usize>(&self) -> Carry<Pack<K>, A> {
        let mut first = Carry::zero();
        for a in 0..A {
            first.argument[a] = self.argument[a];
            first.rate[a] = self.rate[a];
            first.value[a] = self.value[a];
            first.near[a] = self.near[a];
            first.stiction[a] = self.stiction[a];
        }
        first
    }

    /// Replace the first `A` channels.
    #[inline(always)]
    pub fn set_first<const A: usize>(&mut self, first: &Carry<Pack<K>, A>) {
        self.argument[..A].copy_from_slice(&first.argument);
        self.rate[..A].copy_from_slice(&first.rate);
        self.value[..A].copy_from_slice(&first.value);
        self.near[..A].copy_from_slice(&first.near);
        self.stiction[..A].copy_from_slice(&first.stiction);
    }
}

impl<const K: usize, const A: usize> Carry<Pack<K>, A> {
    /// Replace one run.
    #[inline(always)]
    pub fn take_lane(&mut self, lane: usize, from: &Self) {
        for a in 0..A {
            self.argument[a].0[lane] = from.argument[a].0[lane];
            self.rate[a].0[lane] = from.rate[a].0[lane];
            self.near[a].0[lane] = from.near[a].0[lane];
            self.stiction[a].0[lane] = from.stiction[a].0[lane];
            let (to, from) = (&mut self.value[a], &from.value[a]);
            to.value.0[lane] = from.value.0[lane];
            to.by_argument.0[lane] = from.by_argument.0[lane];
            to.bend.0[lane] = from.bend.0[lane];
            to.by_normal.0[lane] = from.by_normal.0[lane];
            to.mixed.0[lane] = from.mixed.0[lane];
        }
    }
}
