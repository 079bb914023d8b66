// SPDX-License-Identifier: MIT
//! Several runs over the same knots, side by side through the inner loop.
//!
//! Every lane owns the operators of its own mode; what a lane does not have is zero there, so that runs
//! in different modes need no masks. A run in which a guard could fall leaves the formation, passes
//! its event alone by Taylor expansion, and joins again at a later sample. No operation mixes lanes and
//! every run does what it would do alone: results depend neither on the neighbours nor on their number.

use super::inputs::Inputs;
use super::integrator::{Integrator, Step};
use super::lanes::{Task, dispatch};
use super::march::{BLOCK, Carry, Guards, Room, Source, Trail, idle_guards, march, room};
use super::operators::{Carried, MAX_ACTIVE, Operators};
use super::sprint::{Lines, Ready, Samples, Sink};
use super::status::Status;
use crate::network::smooth::Sample;
use crate::number::{Lane, Pack};
use std::borrow::Borrow;

/// Runs in a formation: two vectors of the narrower sets, one of the widest.
pub const WIDTH: usize = 8;

type Lanes = Pack<WIDTH>;

/// Takes samples and steps of one run.
pub trait Recording: Sink<f64> {
    /// A step of the Taylor expansion; `last` where the run ends with it.
    fn stepped(&mut self, run: &Integrator<'_, f64>, step: &Step<f64>, last: bool);
}

/// One run and where it stands.
struct Member<'r, 'a, S> {
    run: &'r mut Integrator<'a, f64>,
    sink: &'r mut S,
    /// What it joins or has joined with; none once it has ended.
    ready: Option<Ready<f64>>,
    /// Segment at which its operators end.
    until: usize,
    /// First sample that its sink has not got.
    from: usize,
    joined: bool,
    outcome: Result<(), Status>,
}

/// Run up to [`WIDTH`] integrators, all over the same knots and with as many states, to their ends.
pub fn run_together<'r, 'a: 'r, S: Recording + 'r>(
    runs: impl Iterator<Item = (&'r mut Integrator<'a, f64>, &'r mut S)>,
) -> Vec<Result<(), Status>> {
    let mut members: Vec<Member<'r, 'a, S>> = runs
        .map(|(run, sink)| {
            let (ready, outcome) = (None, Ok(()));
            let mut member = Member { run, sink, ready, until: 0, from: 0, joined: false, outcome };
            member.go_on(false);
            member
        })
        .collect();
    let states = members.first().map_or(0, |member| member.run.x.len());
    match states {
        0..=4 => Formation::<4>::new().march(&mut members),
        _ => Formation::<8>::new().march(&mut members),
    }
    members.into_iter().map(|member| member.outcome).collect()
}

impl<S: Recording> Member<'_, '_, S> {
    /// Pass samples alone until the formation can be joined; `step` where an expansion is due.
    fn go_on(&mut self, step: bool) {
        self.joined = false;
        self.ready = None;
        match self.alone(step) {
            Ok(ready) => {
                self.until = ready.as_ref().map_or(0, |ready| self.run.segment + ready.count);
                self.ready = ready;
            }
            Err(status) => self.outcome = Err(status),
        }
    }

    fn alone(&mut self, mut step: bool) -> Result<Option<Ready<f64>>, Status> {
        loop {
            if step {
                let step = self.run.expand_step()?;
                let last = self.run.is_at_end();
                self.sink.stepped(self.run, &step, last);
            }
            if !self.run.take_up_next()? {
                return Ok(None);
            }
            if let Some(ready) = self.run.ready_to_sprint() {
                return Ok(Some(ready));
            }
            step = true;
        }
    }
}

/// Operators and states of all lanes, over at most `N` states.
struct Formation<const N: usize> {
    operators: Operators<Lanes, N>,
    /// Carried channels by number, the union over the lanes, in order.
    slots: Vec<usize>,
    /// Watched guards by number, likewise.
    watched: Vec<usize>,
    x: [Lanes; N],
    carry: [Carry<Lanes>; MAX_ACTIVE],
    guards: Guards<Lanes>,
    trail: Trail<Lanes, N>,
    /// Segment of the first sample in the trail, and number of samples.
    stretch: (usize, usize),
}

impl<const N: usize> Formation<N> {
    fn new() -> Self {
        let zero = Lanes::all(0.0);
        Self {
            operators: Operators::idle(),
            slots: Vec::new(),
            watched: Vec::new(),
            x: [zero; N],
            carry: [Carry::idle(); MAX_ACTIVE],
            guards: idle_guards(),
            trail: Trail::in_columns(Vec::new(), MAX_ACTIVE),
            stretch: (0, 0),
        }
    }

    /// March until every member has ended.
    fn march<S: Recording>(mut self, members: &mut [Member<'_, '_, S>]) {
        let live = |member: &Member<'_, '_, S>| member.ready.is_some();
        while let Some(segment) = members.iter().filter(|m| live(m)).map(|m| m.run.segment).min() {
            if segment != self.stretch.0 + self.stretch.1 || self.stretch.1 == BLOCK {
                self.hand_over(members, segment);
            }
            let joining = self.join(members, segment);
            let ahead = |m: &Member<'_, '_, S>| if m.joined { m.until } else { m.run.segment };
            let until = members.iter().filter(|m| live(m)).map(ahead).min().unwrap_or(segment);
            let samples = (segment, (until - segment).min(BLOCK - self.stretch.1));
            let marching = members.iter().find(|m| m.joined).and_then(|m| m.ready.as_ref());
            let Some(h) = marching.map(|ready| ready.h) else { break };
            let inputs: [&Inputs<f64>; WIDTH] = std::array::from_fn(|lane| {
                members[if lane < members.len() { lane } else { 0 }].run.inputs
            });
            let live = members.iter().enumerate().filter(|(_, m)| m.joined);
            let live = live.fold(0, |bits, (lane, _)| bits | 1 << lane);
            let (passed, fallen) = self.pass((&inputs, h), samples, (joining, live));
            for (lane, member) in members.iter_mut().enumerate().filter(|(_, m)| m.joined) {
                let fell = fallen >> lane & 1 == 1;
                // Those that did not fall have passed the sample in which others did.
                member.run.segment = segment + passed + usize::from(fallen != 0 && !fell);
                if fell || member.run.segment == member.until {
                    let start = self.stretch.1 + passed;
                    let x = |i| if fell { self.trail.states(i)[start] } else { self.x[i] };
                    let x: [f64; N] = std::array::from_fn(|i| x(i).0[lane]);
                    self.deliver(lane, member);
                    self.leave(lane, member, (&x, fell));
                }
            }
            self.stretch.1 += passed + usize::from(fallen != 0);
        }
    }

    /// Take in the members that stand at `segment`; their lanes as bits.
    fn join<S: Recording>(&mut self, members: &mut [Member<'_, '_, S>], segment: usize) -> u32 {
        let mut joining = 0;
        for (lane, member) in members.iter_mut().enumerate() {
            if member.ready.is_some() && !member.joined && member.run.segment == segment {
                (member.joined, member.from) = (true, segment);
                joining |= 1 << lane;
            }
        }
        if joining == 0 {
            return 0;
        }
        let anew = self.arrange(members, segment);
        for (lane, member) in members.iter().enumerate().filter(|(_, m)| m.joined) {
            if anew || joining >> lane & 1 == 1 {
                let ready = member.ready.as_ref().expect("a member that has joined");
                let places = (&self.slots[..], &self.watched[..], &ready.active[..]);
                self.operators.set_lane(lane, operators_of::<N>(ready), places);
            }
            if joining >> lane & 1 == 1 {
                for (x, &value) in self.x.iter_mut().zip(&member.run.x) {
                    x.0[lane] = value;
                }
            }
        }
        joining
    }

    /// Find places for the channels and guards of all that march; whether they are others than before.
    fn arrange<S: Recording>(&mut self, members: &mut [Member<'_, '_, S>], segment: usize) -> bool {
        let (mut slots, mut watched) = (0_u64, 0_u64);
        for ready in members.iter().filter(|m| m.joined).filter_map(|m| m.ready.as_ref()) {
            slots |= bits(ready.active.iter().copied());
            watched |= bits(operators_of::<N>(ready).watched.iter().map(|guard| guard.id));
        }
        let present = [&self.slots, &self.watched].map(|ids| bits(ids.iter().copied()));
        if present == [slots, watched] {
            return false;
        }
        let [slots, watched] = [slots, watched].map(numbers);
        self.hand_over(members, segment);
        // Those that march get all their places anew; what is left of others moves nothing that counts.
        if slots.len() == MAX_ACTIVE - 1 {
            self.operators.channels[MAX_ACTIVE - 1] = Carried::idle();
        }
        let slots = std::mem::replace(&mut self.slots, slots);
        let watched = std::mem::replace(&mut self.watched, watched);
        self.rearrange(&slots, &watched);
        true
    }

    /// Carry and guards from the old places to the new ones.
    fn rearrange(&mut self, slots: &[usize], watched: &[usize]) {
        let (carry, guards) = (self.carry, self.guards);
        self.carry = [Carry::idle(); MAX_ACTIVE];
        self.guards = idle_guards();
        for (to, id) in self.slots.iter().enumerate() {
            if let Some(from) = slots.iter().position(|old| old == id) {
                self.carry[to] = carry[from];
            }
        }
        for (to, id) in self.watched.iter().enumerate() {
            if let Some(from) = watched.iter().position(|old| old == id) {
                self.guards[to] = guards[from];
            }
        }
    }

    /// Pass samples with the inner loop for the number of carried channels.
    fn pass(
        &mut self,
        source: (&Together<'_>, f64),
        samples: (usize, usize),
        lanes: (u32, u32),
    ) -> (usize, u32) {
        match self.slots.len() {
            0 => dispatch(Pass::<N, 0> { formation: self, source, samples, lanes }),
            1 => dispatch(Pass::<N, 1> { formation: self, source, samples, lanes }),
            2 => dispatch(Pass::<N, 2> { formation: self, source, samples, lanes }),
            _ => dispatch(Pass::<N, MAX_ACTIVE> { formation: self, source, samples, lanes }),
        }
    }

    /// Hand the samples of all that march on, and begin the trail anew at `segment`.
    fn hand_over<S: Recording>(&mut self, members: &mut [Member<'_, '_, S>], segment: usize) {
        for (lane, member) in members.iter_mut().enumerate().filter(|(_, m)| m.joined) {
            self.deliver(lane, member);
        }
        self.stretch = (segment, 0);
    }

    /// Hand the samples up to the segment of a member on.
    fn deliver<S: Recording>(&self, lane: usize, member: &mut Member<'_, '_, S>) {
        let (from, to) = (member.from, member.run.segment);
        if from == to {
            return;
        }
        let active = &member.ready.as_ref().expect("a member that has joined").active;
        let (first, places) = (from - self.stretch.0, self.places(active));
        let view = LaneView { trail: &self.trail, first, lane, places };
        member.sink.passed(member.run, active, &view, (from, to - from));
        member.from = to;
    }

    /// Slots of the channels of one lane.
    fn places(&self, active: &[usize]) -> [usize; MAX_ACTIVE] {
        let mut places = [0; MAX_ACTIVE];
        for (place, id) in places.iter_mut().zip(active) {
            *place = self.slots.iter().position(|slot| slot == id).unwrap_or(0);
        }
        places
    }

    /// Let a member go with its state `x` at the start of its segment, in which a guard may fall.
    fn leave<S: Recording>(
        &mut self,
        lane: usize,
        member: &mut Member<'_, '_, S>,
        (x, fell): (&[f64; N], bool),
    ) {
        let run = &mut *member.run;
        let n = run.x.len();
        run.x.copy_from_slice(&x[..n]);
        run.t = run.inputs.knot(run.segment);
        let ended = run.segment == run.inputs.segments();
        if ended {
            let active = member.ready.take().map_or_else(Vec::new, |ready| ready.active);
            let places = self.places(&active);
            let torque =
                |&slot: &usize| self.operators.channels[slot].torque(&self.carry[slot]).0[lane];
            let torques = places[..active.len()].iter().map(torque).collect();
            let end = LastSample { x, torques };
            member.sink.passed(member.run, &active, &end, (member.run.segment, 1));
            member.run.segment -= 1;
            member.joined = false;
        } else {
            member.run.resume();
            member.go_on(fell);
        }
    }
}

/// A set of numbers as bits.
fn bits(numbers: impl Iterator<Item = usize>) -> u64 {
    numbers.fold(0, |bits, number| bits | 1 << number)
}

/// The numbers of the bits that are set, in order.
fn numbers(bits: u64) -> Vec<usize> {
    (0..u64::BITS as usize).filter(|number| bits >> number & 1 == 1).collect()
}

fn operators_of<const N: usize>(ready: &Ready<f64>) -> &Operators<f64, N> {
    ready.operators.of_size::<N>().expect("all members have as many states")
}

/// One call of the inner loop.
struct Pass<'f, 's, const N: usize, const A: usize> {
    formation: &'f mut Formation<N>,
    source: (&'s Together<'s>, f64),
    samples: (usize, usize),
    /// Those that join and all that march, as bits.
    lanes: (u32, u32),
}

impl<const N: usize, const A: usize> Task for Pass<'_, '_, N, A> {
    type Output = (usize, u32);

    #[inline(always)]
    fn run<const F: bool>(self) -> (usize, u32) {
        let first = self.source.0[0];
        if self.source.0.iter().all(|inputs| std::ptr::eq(*inputs, first)) {
            self.pass::<F, _>(&Lines(first))
        } else {
            let source = self.source.0;
            self.pass::<F, _>(source)
        }
    }
}

impl<const N: usize, const A: usize> Pass<'_, '_, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: Source<Lanes>>(self, source: &U) -> (usize, u32) {
        let Self { formation, source: (_, h), samples, lanes: (joining, live) } = self;
        let Formation { operators, x, carry, guards, trail, stretch: (_, at), .. } = formation;
        let carry = carry.first_chunk_mut::<A>().expect("at most as many");
        if joining != 0 {
            let mut room = room();
            let sample = source.read(samples.0, &mut room);
            let fresh: [_; A] = Carry::start::<F, N, A, _>(operators, (sample, h), x);
            let first = operators.guards::<_, F, A>(sample, (x, &fresh));
            for lane in (0..WIDTH).filter(|lane| joining >> lane & 1 == 1) {
                for (carry, fresh) in carry.iter_mut().zip(&fresh) {
                    carry.set_lane(lane, fresh);
                }
                for (guard, first) in guards.as_flattened_mut().iter_mut().zip(first.as_flattened())
                {
                    guard.0[lane] = first.0[lane];
                }
            }
        }
        let state = (&mut *x, carry, &mut *guards);
        let to = (trail, *at, live);
        march::<U, Lanes, F, N, A, 1>(operators, (source, h), samples, state, to)
    }
}

/// The inputs of every lane.
type Together<'a> = [&'a Inputs<f64>; WIDTH];

impl Source<Lanes> for Together<'_> {
    type Input = Lanes;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut Room<Lanes>) -> &'s Sample<Lanes> {
        for (lane, inputs) in self.iter().enumerate() {
            for (to, &[start, rate]) in room.iter_mut().zip(inputs.lines(segment)) {
                (to[0].0[lane], to[1].0[lane]) = (start, rate);
            }
        }
        &room[..self[0].lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [Lanes; 2] {
        let mut bounds = [Pack::all(0.0); 2];
        for (lane, inputs) in self.iter().enumerate() {
            let [low, high] = inputs.bounds(input, samples);
            (bounds[0].0[lane], bounds[1].0[lane]) = (low, high);
        }
        bounds
    }
}

/// The inputs that all lanes share.
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

/// The samples of one lane.
struct LaneView<'f, const N: usize> {
    trail: &'f Trail<Lanes, N>,
    /// Place of the first.
    first: usize,
    lane: usize,
    places: [usize; MAX_ACTIVE],
}

impl<const N: usize> Samples<f64> for LaneView<'_, N> {
    fn states(&self, i: usize) -> impl Iterator<Item: Borrow<f64>> {
        let lane = self.lane % WIDTH;
        self.trail.states(i)[self.first..].iter().map(move |x| x.0[lane])
    }
    fn torques(&self, slot: usize) -> impl Iterator<Item: Borrow<f64>> {
        let torques = &self.trail.torques(self.places[slot])[self.first..];
        let lane = self.lane % WIDTH;
        torques.iter().map(move |torque| torque.0[lane])
    }
}

/// The end of one lane.
struct LastSample<'f, const N: usize> {
    x: &'f [f64; N],
    torques: Vec<f64>,
}

impl<const N: usize> Samples<f64> for LastSample<'_, N> {
    fn states(&self, i: usize) -> impl Iterator<Item: Borrow<f64>> {
        std::iter::once(self.x[i])
    }
    fn torques(&self, slot: usize) -> impl Iterator<Item: Borrow<f64>> {
        std::iter::once(self.torques[slot])
    }
}
