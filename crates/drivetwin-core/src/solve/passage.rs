// SPDX-License-Identifier: MIT
//! Samples of several runs side by side: each joins at its own and leaves before the one in which a guard
//! could fall.

use super::formation::{Lanes, Member, Record, Standing, WIDTH, bits, each};
use super::inputs::Inputs;
use super::lanes::{Task, dispatch};
use super::march::{BLOCK, Carry, Column, Room, Source, Trail, march, room};
use super::operators::Operators;
use super::regime::Regime;
use super::sprint::Lines;
use super::watch::{Guards, idle_guards};
use crate::network::smooth::Sample;
use crate::number::{Factor, Lane, Number, Pack};

/// Runs before samples of one length.
pub(super) struct Passage<'p, 'a> {
    pub regime: &'p mut Regime<'a, Lanes>,
    pub members: &'p mut [Member<'a>],
    /// Channels that are not off.
    pub active: &'p [usize],
    /// Length of the samples, s.
    pub h: f64,
    /// Working space.
    pub columns: &'p mut Vec<Column<Lanes>>,
}

impl Passage<'_, '_> {
    /// Let all that stand before such samples pass them. Returns, as bits, those that have arrived at the end
    /// of such samples; the others are due.
    pub fn pass<const N: usize>(
        self,
        operators: &Operators<Lanes, N>,
        record: &mut impl Record,
    ) -> u32 {
        let passage = self;
        match operators.channels.len() {
            0 => dispatch(Pass::<_, N, 0> { passage, operators, record }),
            1 => dispatch(Pass::<_, N, 1> { passage, operators, record }),
            2 => dispatch(Pass::<_, N, 2> { passage, operators, record }),
            _ => dispatch(Pass::<_, N, 4> { passage, operators, record }),
        }
    }
}

/// [`Passage::pass`] with `A` channels.
struct Pass<'o, 'p, 'a, R, const N: usize, const A: usize> {
    passage: Passage<'p, 'a>,
    operators: &'o Operators<Lanes, N>,
    record: &'o mut R,
}

impl<R: Record, const N: usize, const A: usize> Task for Pass<'_, '_, '_, R, N, A> {
    type Output = u32;

    #[inline(always)]
    fn run<const F: bool>(self) -> u32 {
        let members = &*self.passage.members;
        let first = members[0].inputs;
        if members.iter().all(|member| std::ptr::eq(member.inputs, first)) {
            self.pass::<F, _>(&Lines(first))
        } else {
            let of = |run: usize| members[if run < members.len() { run } else { 0 }].inputs;
            let together: Together<'_> = std::array::from_fn(of);
            self.pass::<F, _>(&together)
        }
    }
}

/// Samples that have been passed but not handed on.
pub struct Stretch {
    /// Number of the first.
    pub first: usize,
    /// How many.
    pub count: usize,
    /// Of these those at which each run stood: from one to before another.
    pub spans: [(usize, usize); WIDTH],
}

impl Stretch {
    fn from(first: usize) -> Self {
        Self { first, count: 0, spans: [(0, 0); WIDTH] }
    }

    /// Samples begin for some runs, as bits.
    fn begin(&mut self, runs: u32) {
        each(runs).for_each(|run| self.spans[run] = (self.count, self.count));
    }

    /// More samples, for some runs, as bits.
    fn add(&mut self, count: usize, runs: u32) {
        self.count += count;
        each(runs).for_each(|run| self.spans[run].1 = self.count);
    }
}

impl<R: Record, const N: usize, const A: usize> Pass<'_, '_, '_, R, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: Source<Lanes>>(self, source: &U) -> u32 {
        let Self { passage, operators, record } = self;
        let Passage { regime, members, active, h, columns } = passage;
        let mut waiting = ahead(members);
        let places = places(members);
        let mut segment = next(&places, waiting);
        let (last, end) = {
            let inputs = members[0].inputs;
            (inputs.segments(), segment + inputs.equal_from(segment))
        };
        let mut trail = Trail::in_columns(std::mem::take(columns), A);
        let mut stretch = Stretch::from(segment);
        let mut front =
            Front { x: [Lanes::zero_(); N], carry: [Carry::idle(); A], guards: idle_guards() };
        let (mut abreast, mut room) = (0, room());
        while segment < end {
            let joining = waiting & those_at(&places, segment);
            if joining != 0 {
                let sample = source.read(segment, &mut room);
                front.join::<F, _>(operators, (joining, &regime.x), sample);
                abreast |= joining;
                waiting &= !joining;
                stretch.begin(joining);
            }
            let until = next(&places, waiting).min(end);
            if abreast == 0 || stretch.count == BLOCK {
                record.passed(regime, active, trail.samples(), &stretch);
                segment = if abreast == 0 { until } else { segment };
                stretch = Stretch::from(segment);
                continue;
            }
            let samples = (segment, (until - segment).min(BLOCK - stretch.count));
            let at = (&mut front.x, &mut front.carry, &mut front.guards);
            let to = (&mut trail, stretch.count, abreast);
            let (count, fallen) =
                march::<U, Lanes, F, N, A, 1>(operators, (source, h), samples, at, to);
            stretch.add(count, abreast);
            segment += count;
            if fallen != 0 {
                for run in each(fallen) {
                    let x = |i: usize| trail.states(i)[stretch.count].0[run];
                    leave(regime, &mut members[run], run, (segment, x));
                    members[run].standing = Standing::Due;
                }
                // Those that have not fallen have passed the sample in which others did.
                abreast &= !fallen;
                stretch.add(1, abreast);
                segment += 1;
            }
        }
        for run in each(abreast) {
            leave(regime, &mut members[run], run, (segment, |i: usize| front.x[i].0[run]));
        }
        if segment == last {
            stretch.add(1, abreast);
        }
        record.passed(regime, active, trail.samples(), &stretch);
        *columns = trail.into_columns();
        abreast
    }
}

/// States, channels and guards of the runs abreast.
struct Front<const N: usize, const A: usize> {
    x: [Lanes; N],
    carry: [Carry<Lanes>; A],
    guards: Guards<Lanes>,
}

impl<const N: usize, const A: usize> Front<N, A> {
    /// Take runs in, as bits, with their states.
    #[inline(always)]
    fn join<const F: bool, U: Factor<Lanes, Values: Factor<Lanes>>>(
        &mut self,
        operators: &Operators<Lanes, N>,
        (runs, x): (u32, &[Lanes]),
        sample: &Sample<U>,
    ) {
        for (to, &from) in self.x.iter_mut().zip(x) {
            *to = to.with(runs, from);
        }
        let fresh: [_; A] = Carry::start::<F, N, A, _>(operators, sample, &self.x);
        let first = operators.guards::<_, F, A>(sample, (&self.x, &fresh));
        for a in 0..A {
            self.carry[a] = self.carry[a].with(runs, &fresh[a]);
        }
        for (to, &from) in self.guards.as_flattened_mut().iter_mut().zip(first.as_flattened()) {
            *to = to.with(runs, from);
        }
    }
}

/// Let a run go with its state at the start of a segment.
fn leave(
    regime: &mut Regime<'_, Lanes>,
    member: &mut Member<'_>,
    run: usize,
    (segment, x): (usize, impl Fn(usize) -> f64),
) {
    for (i, to) in regime.x.iter_mut().enumerate() {
        to.0[run] = x(i);
    }
    regime.t.0[run] = member.inputs.knot(segment);
    member.segment = segment;
}

/// Runs that stand before samples, as bits.
fn ahead(members: &[Member<'_>]) -> u32 {
    bits(members.iter().map(|member| member.standing == Standing::Ahead))
}

/// Segments of the runs, side by side.
fn places(members: &[Member<'_>]) -> [usize; WIDTH] {
    std::array::from_fn(|run| members.get(run).map_or(usize::MAX, |member| member.segment))
}

/// Runs at a segment, as bits.
fn those_at(places: &[usize; WIDTH], segment: usize) -> u32 {
    bits(places.iter().map(|&place| place == segment))
}

/// The first segment at which one of these runs stands.
fn next(places: &[usize; WIDTH], runs: u32) -> usize {
    each(runs).map(|run| places[run]).min().unwrap_or(usize::MAX)
}

/// The inputs of every run.
type Together<'a> = [&'a Inputs<f64>; WIDTH];

impl Source<Lanes> for Together<'_> {
    type Input = Lanes;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut Room<Lanes>) -> &'s Sample<Lanes> {
        for (run, inputs) in self.iter().enumerate() {
            for (to, &[start, rate]) in room.iter_mut().zip(inputs.lines(segment)) {
                (to[0].0[run], to[1].0[run]) = (start, rate);
            }
        }
        &room[..self[0].lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [Lanes; 2] {
        let mut bounds = [Lanes::zero_(); 2];
        for (run, inputs) in self.iter().enumerate() {
            let [low, high] = inputs.bounds(input, samples);
            (bounds[0].0[run], bounds[1].0[run]) = (low, high);
        }
        bounds
    }
}

/// The inputs that all share.
impl Source<Lanes> for Lines<'_, f64> {
    type Input = f64;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, _: &'s mut Room<f64>) -> &'s Sample<f64> {
        self.0.lines(segment)
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [Lanes; 2] {
        self.0.bounds(input, samples).map(Pack::all)
    }
}
