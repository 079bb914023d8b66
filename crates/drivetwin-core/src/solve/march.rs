// SPDX-License-Identifier: MIT
//! Sample after sample in one mode, for one run or several side by side.
//!
//! The torque φ of a slipping element is a cubic in time over a sample, through value and rate at both
//! ends. Its argument at the end is predicted with the second derivative of φ at the start, which
//! leaves an error of fourth order; the cubic through the predicted end corrects it, and the law is
//! moved to the corrected argument by its own derivatives. One exponential a sample and channel, taken
//! before its argument is known exactly.

use super::law::Value;
use super::operators::{
    CUBIC, Carried, Form, MAX_ACTIVE, MAX_WATCHED, Operators, StepForm, Watched,
};
use crate::number::{Lane, Pack, Values};

/// Samples that are passed before they are handed on.
pub const BLOCK: usize = 64;

/// Most inputs of a network that is marched.
pub const MAX_INPUTS: usize = 16;

/// Value at the start of a sample and rate within it, of every input.
pub type Sample<L> = [[L; 2]; MAX_INPUTS];

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

/// Inputs have few enough numbers to need no check.
#[inline(always)]
pub fn input_of<L: Copy>(sample: &Sample<L>, input: usize) -> [L; 2] {
    sample[input % MAX_INPUTS]
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

/// Largest cubic part of a channel over a sample, relative to its size.
const MAX_CUBIC: f64 = 2e-4;
/// Largest distance over which stiction is moved by its series, relative to its decay.
const MAX_MOVE: f64 = 0.05;
/// Largest change of a channel by the correction, relative to its size.
const MAX_CORRECTION: f64 = 1e-6;

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

/// One sample; returns the least guard of the carried channels.
#[inline(always)]
fn step<L: Lane, const F: bool, const N: usize, const A: usize>(
    op: &Operators<L, N>,
    (sample, h): (&Sample<L>, f64),
    (x, carry): (&mut [L; N], &mut Carry<L, A>),
) -> L::Values {
    let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
    let mut end = op.constant;
    let none = L::all(0.0);
    let (mut argument, mut rate, mut direct) = ([none; A], [none; A], [none; A]);
    let (mut second, mut lines) = ([none; A], [[none; 2]; A]);
    for a in 0..A {
        let c = &channels[a];
        argument[a] = c.argument_end.constant;
        rate[a] = c.rate_end.constant;
        direct[a] = c.rate.constant;
        second[a] = c.second.constant;
        lines[a] = c.law.normal.line::<F>(sample);
    }
    for drive in &op.drives {
        let [u, du] = input_of(sample, drive.input);
        let u_end = du.times(h) + u;
        for i in 0..N {
            end[i] = drive.step[0][i].fma::<F>(u, drive.step[1][i].fma::<F>(du, end[i]));
        }
        for a in 0..A {
            argument[a] = pair::<L, F>(&drive.argument[a], (u, du), argument[a]);
            rate[a] = pair::<L, F>(&drive.rate[a], (u, du), rate[a]);
            direct[a] = drive.now[a].fma::<F>(u_end, direct[a]);
            second[a] = drive.second[a].fma::<F>(u, drive.now[a].fma::<F>(du, second[a]));
        }
    }
    for j in 0..op.columns() {
        for i in 0..N {
            end[i] = op.transition[j][i].fma::<F>(x[j], end[i]);
        }
        for a in 0..A {
            argument[a] = channels[a].argument_end.state[j].fma::<F>(x[j], argument[a]);
            rate[a] = channels[a].rate_end.state[j].fma::<F>(x[j], rate[a]);
            second[a] = channels[a].second.state[j].fma::<F>(x[j], second[a]);
        }
    }
    // Stiction at about the end, early: nothing waits for the exponential then.
    let mut near = [(none, none); A];
    for a in 0..A {
        let about = carry.rate[a].times(h) + carry.argument[a];
        near[a] = (about, channels[a].law.stiction::<F>(about));
    }
    // The cubics as known at the start: value, rate and second derivative.
    let start = carry.value;
    let mut cubics = [[none; CUBIC]; A];
    for a in 0..A {
        let v = &start[a];
        let slope = v.by_argument.fma::<F>(carry.rate[a], v.by_normal * lines[a][1]);
        (cubics[a][0], cubics[a][1]) = (v.value, slope.times(h));
    }
    for a in 0..A {
        for b in 0..A {
            second[a] = channels[a].second.channels[b].fma::<F>(cubics[b][0], second[a]);
            let rate = channels[a].rate.channels[b].times(1.0 / h);
            second[a] = rate.fma::<F>(cubics[b][1], second[a]);
        }
        let (v, ds) = (&start[a], carry.rate[a]);
        let mixed = v.mixed * lines[a][1];
        let turn = v.bend.fma::<F>(ds, mixed + mixed);
        cubics[a][2] = v.by_argument.fma::<F>(second[a], turn * ds).times(0.5 * h * h);
    }
    add_moments::<L, F, N, A, 0, 3>(op, &cubics, &mut end);
    // The end as predicted, and the cubics through it.
    let mut value = start;
    let mut least = L::Values::all(1.0);
    for a in 0..A {
        argument[a] =
            over_cubics::<L, F, N, A, 0, 3>(&channels[a].argument_end, &cubics, argument[a]);
        rate[a] = over_cubics::<L, F, N, A, 0, 3>(&channels[a].rate_end, &cubics, rate[a]);
        let (law, normal) = (&channels[a].law, lines[a][1].times(h) + lines[a][0]);
        let (stiction, moved) = law.moved_stiction::<F>(near[a].1, argument[a] - near[a].0);
        value[a] = law.at::<F>(argument[a], stiction, normal);
        least = least.lower(L::Values::all(MAX_MOVE) - moved.values().magnitude());
    }
    let mut change = [[none; CUBIC]; A];
    for a in 0..A {
        let ds = rate[a] + over_channels::<L, F, N, A>(&channels[a].rate, &value, direct[a]);
        let slope = value[a].by_argument.fma::<F>(ds, value[a].by_normal * lines[a][1]).times(h);
        let rise = value[a].value - cubics[a][0];
        let bent = rise.times(3.0) - cubics[a][1].times(2.0) - slope;
        change[a][2] = bent - cubics[a][2];
        change[a][3] = cubics[a][1] + slope - rise.times(2.0);
    }
    add_moments::<L, F, N, A, 2, 4>(op, &change, &mut end);
    let before = (carry.argument, carry.rate);
    for a in 0..A {
        let ds = over_cubics::<L, F, N, A, 2, 4>(&channels[a].argument_end, &change, none);
        rate[a] = over_cubics::<L, F, N, A, 2, 4>(&channels[a].rate_end, &change, rate[a]);
        let corrected = value[a].moved::<F>(ds);
        let size = start[a].value.values().magnitude() + L::Values::all(1.0);
        let correction = (corrected.value - value[a].value).values().magnitude();
        least = least.lower(size.times(MAX_CUBIC) - change[a][3].values().magnitude());
        least = least.lower(size.times(MAX_CORRECTION) - correction);
        carry.argument[a] = argument[a] + ds;
        carry.value[a] = corrected;
    }
    for a in 0..A {
        carry.rate[a] =
            rate[a] + over_channels::<L, F, N, A>(&channels[a].rate, &carry.value, direct[a]);
        let law = &channels[a].law;
        // Between its ends the argument stays within these values (Bernstein's form of the cubic).
        let (m0, m3) = (before.0[a].values(), carry.argument[a].values());
        let m1 = before.1[a].values().times(h / 3.0) + m0;
        let m2 = m3 - carry.rate[a].values().times(h / 3.0);
        let (low, high) = (m0.lower(m1).lower(m2.lower(m3)), m0.upper(m1).upper(m2.upper(m3)));
        least = least.lower(low - law.from.values()).lower(law.to.values() - high);
    }
    *x = end;
    least
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

#[inline(always)]
fn pair<L: Lane, const F: bool>(coefficients: &[L; 2], (u, du): (L, L), sum: L) -> L {
    coefficients[0].fma::<F>(u, coefficients[1].fma::<F>(du, sum))
}

#[inline(always)]
fn add_moments<
    L: Lane,
    const F: bool,
    const N: usize,
    const A: usize,
    const FROM: usize,
    const TO: usize,
>(
    op: &Operators<L, N>,
    cubics: &[[L; CUBIC]; A],
    end: &mut [L; N],
) {
    for a in 0..A {
        for k in FROM..TO {
            for i in 0..N {
                end[i] = op.channels[a].moments[k][i].fma::<F>(cubics[a][k], end[i]);
            }
        }
    }
}

#[inline(always)]
fn over_cubics<
    L: Lane,
    const F: bool,
    const N: usize,
    const A: usize,
    const FROM: usize,
    const TO: usize,
>(
    form: &StepForm<L, N>,
    cubics: &[[L; CUBIC]; A],
    sum: L,
) -> L {
    let mut sum = sum;
    for a in 0..A {
        for k in FROM..TO {
            sum = form.cubics[a][k].fma::<F>(cubics[a][k], sum);
        }
    }
    sum
}

#[inline(always)]
fn over_channels<L: Lane, const F: bool, const N: usize, const A: usize>(
    form: &Form<L, N>,
    values: &[Value<L>; A],
    sum: L,
) -> L {
    let mut sum = sum;
    for a in 0..A {
        sum = form.channels[a].fma::<F>(values[a].value, sum);
    }
    sum
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
