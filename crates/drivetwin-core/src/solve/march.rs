// SPDX-License-Identifier: MIT
//! Sample after sample in one mode, for one run or several side by side.
//!
//! The torque φ of a slipping element is a cubic in time over a sample, through value and rate at both
//! ends. Its argument at the end is predicted with the second derivative of φ at the start, which
//! leaves an error of fourth order; the cubic through the predicted end corrects it, and the law is
//! moved to the corrected argument by its own derivatives. One exponential a sample and channel, taken
//! before its argument is known exactly.

use super::operators::{Carried, MAX_ACTIVE, MAX_WATCHED, Operators, Watched};
use super::step::{over_channels, step};
use crate::network::smooth::{MAX_INPUTS, Sample, Value, input_of};
use crate::number::{Lane, Pack, Values};

/// Samples that are passed before they are handed on.
pub const BLOCK: usize = 64;

/// Inputs of one run or several.
pub trait Source<L> {
    /// Fill in the inputs of a segment.
    fn read(&self, segment: usize, sample: &mut Sample<L>);

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
}

/// Values of the watched guards at the start of a sample, and the sizes of their forms.
pub type Guards<V> = [[V; 2]; MAX_WATCHED];

/// Passed samples: states and carried torques at the start of each.
pub struct Trail<L, const N: usize> {
    /// States.
    pub states: [[L; N]; BLOCK],
    /// Torques of the carried channels.
    pub torques: [[L; MAX_ACTIVE]; BLOCK],
}

impl<L: Lane, const N: usize> Default for Trail<L, N> {
    fn default() -> Self {
        let zero = L::all(0.0);
        Self { states: [[zero; N]; BLOCK], torques: [[zero; MAX_ACTIVE]; BLOCK] }
    }
}

/// Pass up to `count` (at most [`BLOCK`]) samples from segment `first`. Returns how many were passed
/// and, as bits, the runs of which a guard could have fallen within the next one. State and carry are
/// those after that sample all the same; its start stands in the trail.
#[inline(always)]
pub fn march<L: Lane, const F: bool, const N: usize, const A: usize>(
    op: &Operators<L, N>,
    (source, h): (&impl Source<L>, f64),
    (first, count): (usize, usize),
    (x, carry, guards): (&mut [L; N], &mut Carry<L, A>, &mut Guards<L::Values>),
    trail: &mut Trail<L, N>,
) -> (usize, u32) {
    let mut u = [[L::all(0.0); 2]; MAX_INPUTS];
    for k in 0..count {
        source.read(first + k, &mut u);
        if L::DERIVATIVES {
            *carry = Carry::start::<F, N>(op, &u, x);
        }
        trail.states[k] = *x;
        carry.torques(op, &mut trail.torques[k]);
        let mut least = step::<L, F, N, A>(op, (&u, h), (x, carry));
        for (place, guard) in guards.iter_mut().enumerate().take(op.watched.len()) {
            let after = op.guard::<F, A>(place, (&u, h), (x, carry));
            let rise = (guard[0] - after[0]).magnitude();
            let bow = op.bow[0].values() * rise + op.bow[1].values() * guard[1].upper(after[1]);
            least = least.lower(guard[0].lower(after[0]) - bow);
            *guard = after;
        }
        for load in &op.loads {
            let [before, rate] = load.line::<F>(&u);
            let (before, rate) = (before.values(), rate.values());
            least = least.lower(before.lower_unless_idle(rate.times(h) + before));
        }
        let fallen = least.fallen();
        if fallen != 0 {
            return (k, fallen);
        }
    }
    (count, 0)
}

impl<L: Lane, const N: usize> Operators<L, N> {
    /// All guards at the start of a segment.
    #[inline(always)]
    pub fn guards<const F: bool, const A: usize>(
        &self,
        sample: &Sample<L>,
        at: (&[L; N], &Carry<L, A>),
    ) -> Guards<L::Values> {
        let mut guards = [[L::Values::all(1.0); 2]; MAX_WATCHED];
        for (place, guard) in guards.iter_mut().enumerate().take(self.watched.len()) {
            *guard = self.guard::<F, A>(place, (sample, 0.0), at);
        }
        guards
    }

    /// A watched guard `elapsed` seconds into a segment, and the size of its form.
    #[inline(always)]
    fn guard<const F: bool, const A: usize>(
        &self,
        place: usize,
        (sample, elapsed): (&Sample<L>, f64),
        (x, carry): (&[L; N], &Carry<L, A>),
    ) -> [L::Values; 2] {
        let Watched { form, limit, side, .. } = &self.watched[place];
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
        let limit = rate.values().times(elapsed) + start.values();
        let towards = (side.values() * torque).upper(-torque);
        [limit - towards, torque.magnitude()]
    }
}

impl<L: Lane, const A: usize> Carry<L, A> {
    /// Nothing carried.
    pub fn zero() -> Self {
        let none = L::all(0.0);
        Self { argument: [none; A], rate: [none; A], value: [Value::zero(); A] }
    }

    /// The torques.
    #[inline(always)]
    pub fn torques<const N: usize>(&self, op: &Operators<L, N>, out: &mut [L; MAX_ACTIVE]) {
        for a in 0..A {
            out[a] = op.channels[a].law.sign * self.value[a].value;
        }
    }

    /// Everything at the start of a segment.
    #[inline(always)]
    pub fn start<const F: bool, const N: usize>(
        op: &Operators<L, N>,
        sample: &Sample<L>,
        x: &[L; N],
    ) -> Self {
        let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
        let none = L::all(0.0);
        let mut out = Self { argument: [none; A], rate: [none; A], value: [Value::zero(); A] };
        for a in 0..A {
            let Carried { argument, law, .. } = &channels[a];
            for i in 0..op.columns() {
                out.argument[a] = argument[i].fma::<F>(x[i], out.argument[a]);
            }
            let m = out.argument[a];
            let normal = law.normal.line::<F>(sample)[0];
            out.value[a] = law.at::<F>(m, law.stiction::<F>(m), normal);
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
        }
        first
    }

    /// Replace the first `A` channels.
    #[inline(always)]
    pub fn set_first<const A: usize>(&mut self, first: &Carry<Pack<K>, A>) {
        self.argument[..A].copy_from_slice(&first.argument);
        self.rate[..A].copy_from_slice(&first.rate);
        self.value[..A].copy_from_slice(&first.value);
    }
}

impl<const K: usize, const A: usize> Carry<Pack<K>, A> {
    /// Replace one run.
    #[inline(always)]
    pub fn take_lane(&mut self, lane: usize, from: &Self) {
        for a in 0..A {
            self.argument[a].0[lane] = from.argument[a].0[lane];
            self.rate[a].0[lane] = from.rate[a].0[lane];
            let (to, from) = (&mut self.value[a], &from.value[a]);
            to.value.0[lane] = from.value.0[lane];
            to.by_argument.0[lane] = from.by_argument.0[lane];
            to.bend.0[lane] = from.bend.0[lane];
            to.by_normal.0[lane] = from.by_normal.0[lane];
            to.mixed.0[lane] = from.mixed.0[lane];
        }
    }
}
