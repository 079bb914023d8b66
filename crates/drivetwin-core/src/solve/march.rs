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

use super::operators::{Carried, MAX_WATCHED, Operators, Watched};
use super::step::{over_channels, step};
use crate::network::smooth::{Line, MAX_INPUTS, Sample, Value};
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

/// Limits and values of the watched forms at the start of a sample.
pub type Guards<V> = [[V; 2]; MAX_WATCHED];

/// Of what is not watched.
pub fn idle_guards<V: Values>() -> Guards<V> {
    [[V::all(1.0), V::all(0.0)]; MAX_WATCHED]
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

/// Inputs at the ends of `W` samples.
type Ends<V, const W: usize> = [[V; W]; MAX_INPUTS];

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
    let mut ends = [[<S::Input as Lane>::Values::all(0.0); W]; MAX_INPUTS];
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
            let end = |[start, rate]: [S::Input; 2]| rate.values().times(h) + start.values();
            if W == 1 {
                left[k] = op.leaves::<_, F, A>(guards, (|i| end(u[i]), !loaded), (&x, &carry));
            } else if looks {
                ends.iter_mut().zip(u).for_each(|(ends, &line)| ends[k] = end(line));
            }
        }
        if W > 1 {
            let to = (&*trail, at + from, some);
            left = op.left::<_, F, A, W>(guards, (&ends, !loaded), to);
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

impl<L: Lane, const N: usize> Operators<L, N> {
    /// Whether every normal load stays above zero over samples, in all runs.
    #[inline(always)]
    fn stays_loaded<S: Source<L>, const F: bool>(
        &self,
        source: &S,
        samples: (usize, usize),
    ) -> bool {
        // A loop: the body of `all` would be compiled apart, for the least of all processors.
        let mut loaded = true;
        for load in &self.loads {
            loaded &= load.stays_positive::<F>(source.bounds(load.input, samples));
        }
        loaded
    }

    /// Negative where a watched form may leave its limits within the sample that ends with these inputs,
    /// states and channels, or a normal load falls there where `loads` are looked at; `guards` are moved on.
    ///
    /// Apart from what falls in the step: sums over a loop that start from nothing stay in vectors.
    #[inline(always)]
    fn leaves<V: Factor<L::Values>, const F: bool, const A: usize>(
        &self,
        guards: &mut Guards<L::Values>,
        (input, loads): (impl Fn(usize) -> V, bool),
        at: (&[L; N], &[Carry<L>; A]),
    ) -> L::Values {
        let mut left = [L::Values::all(0.0)];
        for (place, before) in guards.iter_mut().enumerate().take(self.watched.len()) {
            let after = self.guard::<V, F, A>(place, &input, at);
            self.falls(place, (before, &after.map(|value| [value])), &mut left);
            *before = after;
        }
        if loads {
            for load in &self.loads {
                load.falls::<_, F, 1>(&[input(load.input)], &mut left);
            }
        }
        left[0]
    }

    /// The same of `some` samples together, by what the trail has of them.
    #[inline(always)]
    fn left<V: Factor<L::Values>, const F: bool, const A: usize, const W: usize>(
        &self,
        guards: &mut Guards<L::Values>,
        (ends, loads): (&Ends<V, W>, bool),
        (trail, from, some): (&Trail<L, N>, usize, usize),
    ) -> [L::Values; W] {
        let mut left = [L::Values::all(0.0); W];
        for (place, before) in guards.iter_mut().enumerate().take(self.watched.len()) {
            let after = self.guards_after::<_, F, A, W>(place, ends, (trail, from));
            self.falls(place, (before, &after), &mut left);
            *before = after.map(|values| values[some - 1]);
        }
        if loads {
            for load in &self.loads {
                load.falls::<_, F, W>(&ends[load.input % MAX_INPUTS], &mut left);
            }
        }
        left
    }

    /// All guards at the start of a segment.
    #[inline(always)]
    pub fn guards<U: Factor<L, Values: Factor<L::Values>>, const F: bool, const A: usize>(
        &self,
        sample: &Sample<U>,
        at: (&[L; N], &[Carry<L>; A]),
    ) -> Guards<L::Values> {
        let mut guards = idle_guards();
        for (place, guard) in guards.iter_mut().enumerate().take(self.watched.len()) {
            *guard = self.guard::<_, F, A>(place, |input| sample[input][0].values(), at);
        }
        guards
    }

    /// Limit and value of a watched form at one instant, by the values of inputs there.
    #[inline(always)]
    fn guard<V: Factor<L::Values>, const F: bool, const A: usize>(
        &self,
        place: usize,
        input: impl Fn(usize) -> V,
        (x, carry): (&[L; N], &[Carry<L>; A]),
    ) -> [L::Values; 2] {
        let Watched { form, limit, .. } = &self.watched[place];
        let mut torque = form.constant.values();
        for drive in &self.drives {
            torque = input(drive.input).onto::<F>(drive.watched[place].values(), torque);
        }
        for i in 0..self.columns() {
            torque = form.state[i].values().fma::<F>(x[i].values(), torque);
        }
        for a in 0..A {
            let carried = self.channels[a].torque(&carry[a]).values();
            torque = form.channels[a].values().fma::<F>(carried, torque);
        }
        [input(limit.input).onto::<F>(limit.gain.values(), limit.offset.values()), torque]
    }

    /// The same at the end of `W` samples from `from` on.
    #[inline(always)]
    fn guards_after<V: Factor<L::Values>, const F: bool, const A: usize, const W: usize>(
        &self,
        place: usize,
        ends: &Ends<V, W>,
        (trail, from): (&Trail<L, N>, usize),
    ) -> [[L::Values; W]; 2] {
        let Watched { form, limit, .. } = &self.watched[place];
        let of_input = |input: usize| &ends[input % MAX_INPUTS];
        let mut torque = [form.constant.values(); W];
        for drive in &self.drives {
            add::<L, V, F, W>(&mut torque, drive.watched[place], of_input(drive.input));
        }
        for i in 0..self.columns() {
            let column: &[L; W] = after(trail.states(i), from);
            for k in 0..W {
                torque[k] = form.state[i].values().fma::<F>(column[k].values(), torque[k]);
            }
        }
        for a in 0..A {
            let column: &[L; W] = after(trail.torques(a), from);
            for k in 0..W {
                torque[k] = form.channels[a].values().fma::<F>(column[k].values(), torque[k]);
            }
        }
        let mut limits = [limit.offset.values(); W];
        add::<L, V, F, W>(&mut limits, limit.gain, of_input(limit.input));
        [limits, torque]
    }

    /// Make negative where a watched form may leave its limits within a sample, by these before and after
    /// each.
    #[inline(always)]
    fn falls<const W: usize>(
        &self,
        place: usize,
        (before, after): (&[L::Values; 2], &[[L::Values; W]; 2]),
        fallen: &mut [L::Values; W],
    ) {
        let side = self.watched[place].side.values();
        let [mut limit, mut value] = *before;
        for k in 0..W {
            let (limit_after, value_after) = (after[0][k], after[1][k]);
            let rise = (value_after - value).magnitude();
            let size = value.magnitude().larger(value_after.magnitude());
            let bow = self.bow[0].values() * rise + self.bow[1].values() * size;
            let falls = |limit: L::Values, value: L::Values| {
                let left = limit - bow;
                (left - side * value).negative_with(left + value)
            };
            let fell = falls(limit, value).negative_with(falls(limit_after, value_after));
            fallen[k] = fallen[k].negative_with(fell);
            (limit, value) = (limit_after, value_after);
        }
    }
}

/// The samples after those from `from` on.
#[inline(always)]
fn after<L, const W: usize>(column: &Column<L>, from: usize) -> &[L; W] {
    column[from + 1..].first_chunk().expect("stretches that divide a block")
}

/// Add multiples of inputs.
#[inline(always)]
fn add<L: Lane, V: Factor<L::Values>, const F: bool, const W: usize>(
    sums: &mut [L::Values; W],
    factor: L,
    inputs: &[V; W],
) {
    for k in 0..W {
        sums[k] = inputs[k].onto::<F>(factor.values(), sums[k]);
    }
}

impl<L: Lane> Line<L> {
    /// Whether the line stays above zero in all runs while its input stays within bounds.
    #[inline(always)]
    fn stays_positive<const F: bool>(&self, [low, high]: [L::Values; 2]) -> bool {
        let (gain, offset) = (self.gain.values(), self.offset.values());
        // Above zero where its negative is below.
        let below = |u| (-gain.fma::<F>(u, offset)).negative();
        below(low) & below(high) == L::Values::all(-1.0).negative()
    }

    /// Make negative where the line falls below zero at the end of a sample.
    #[inline(always)]
    fn falls<V: Factor<L::Values>, const F: bool, const W: usize>(
        &self,
        ends: &[V; W],
        fallen: &mut [L::Values; W],
    ) {
        // A load of -0 is none that has fallen.
        let none = L::Values::all(0.0);
        for k in 0..W {
            let load = ends[k].onto::<F>(self.gain.values(), self.offset.values()) + none;
            fallen[k] = fallen[k].negative_with(load);
        }
    }
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
