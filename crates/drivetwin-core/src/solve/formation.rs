// SPDX-License-Identifier: MIT
//! Several runs side by side as one, over packs of numbers.
//!
//! Every run advances to its next event: whole samples together with the others, the rest by Taylor
//! expansions of its own time. Where all have come to the same event they decide together. A run that
//! meets another event, or decides otherwise, parts: it has to be run again in other company or alone. No
//! operation mixes runs: a result depends neither on the neighbours nor on their number.

use super::guard::{Cause, earliest_of_each};
use super::inputs::Inputs;
use super::integrator::Settings;
use super::known::Known;
use super::march::{Column, Samples};
use super::operators::MAX_ACTIVE;
use super::passage::{Passage, Stretch};
use super::progress::{Progress, is_lost};
use super::ready::{AnySize, can_march};
use super::regime::{Event, Regime};
use crate::number::{Lane, Number, Pack, Series, TERMS, Values, together};

/// Runs in a formation: two vectors of the narrower sets, one of the widest.
pub const WIDTH: usize = 8;

/// A number of every run of a formation.
pub type Lanes = Pack<WIDTH>;

/// Takes what the runs of a formation come by.
pub trait Record {
    /// A stretch of samples that were passed in one mode with the channels `active`.
    fn passed(
        &mut self,
        regime: &Regime<'_, Lanes>,
        active: &[usize],
        samples: Samples<'_, Lanes>,
        stretch: &Stretch,
    );

    /// The runs `runs`, as bits, are at samples of their own, `h` [s] after the start of the expansion.
    fn reached(&mut self, regime: &Regime<'_, Lanes>, at: (u32, &[usize; WIDTH]), h: Lanes);
}

/// Where a run stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Standing {
    /// At the start of its segment, to pass samples.
    Ahead,
    /// In need of an expansion.
    Due,
    /// At an event.
    Event(Cause),
    /// At the start of a segment without length: the inputs jump.
    Jump,
    /// At the end of the inputs.
    Ended,
    /// On its own from here on.
    Parted,
}

impl Standing {
    /// Whether the run is still on its way.
    fn is_open(self) -> bool {
        !matches!(self, Self::Ended | Self::Parted)
    }
}

/// One run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member<'a> {
    /// Its inputs.
    pub inputs: &'a Inputs<f64>,
    /// Segment in which it stands; their number at the end.
    pub segment: usize,
    /// Where there.
    pub standing: Standing,
    progress: Progress,
}

/// Runs in one regime.
struct Formation<'a> {
    regime: Regime<'a, Lanes>,
    settings: Settings,
    members: Vec<Member<'a>>,
    /// Events of those that have come to their end.
    events: Vec<Option<Vec<Event<f64>>>>,
    /// Working space of passages.
    columns: Vec<Column<Lanes>>,
    /// Inputs of one run.
    own_inputs: Vec<Series<f64>>,
}

/// Bring runs over the same knots to their ends: the runs `runs`, as bits, with these inputs, from states `x`
/// with the elements `locked` at rest. Returns the events of every run, nothing for one that has parted.
pub fn run_together<'a>(
    known: Known<'a, Lanes>,
    inputs: &[&'a Inputs<f64>],
    (settings, runs): (Settings, u32),
    (x, locked): (Vec<Lanes>, &[usize]),
    record: &mut impl Record,
) -> Vec<Option<Vec<Event<f64>>>> {
    let events = vec![None; inputs.len()];
    if !settings.sprint || !can_march(known.network) {
        return events;
    }
    let start = inputs[0].knot(0);
    let (regime, parting) = together(runs, || Regime::start(known, x, Lanes::of(start)));
    let Ok(regime) = regime else { return events };
    let member = |(run, &inputs): (usize, &&'a Inputs<f64>)| {
        let standing = if runs >> run & 1 == 1 { Standing::Due } else { Standing::Parted };
        Member { inputs, segment: 0, standing, progress: Progress::from(start) }
    };
    let members = inputs.iter().enumerate().map(member).collect();
    let own_inputs = vec![[0.0; TERMS]; regime.ahead.len()];
    let columns = Vec::with_capacity(regime.x.len() + MAX_ACTIVE);
    let mut all = Formation { regime, settings, members, events, columns, own_inputs };
    all.part(parting);
    all.decide(all.open(), |regime| regime.take_up(locked));
    while all.open() != 0 {
        all.advance(record);
        all.change();
    }
    all.events
}

impl Formation<'_> {
    /// Runs of which `say` holds, as bits.
    fn those(&self, say: impl Fn(&Member<'_>) -> bool) -> u32 {
        bits(self.members.iter().map(say))
    }

    /// Runs that are still on their way.
    fn open(&self) -> u32 {
        self.those(|member| member.standing.is_open())
    }

    fn part(&mut self, runs: u32) {
        each(runs).for_each(|run| self.members[run].standing = Standing::Parted);
    }

    /// Bring every run to its next event or to its end.
    fn advance(&mut self, record: &mut impl Record) {
        loop {
            while self.pass_samples(record) {}
            let due = self.those(|member| member.standing == Standing::Due);
            if due == 0 {
                return;
            }
            self.expand(due, record);
            // What was released has moved off in all of them: nobody passes samples with it.
            self.regime.released.fill(false);
        }
    }

    /// Carry out the event at which most runs are; the others part.
    fn change(&mut self) {
        let open = self.open();
        each(open).for_each(|run| self.move_to_knot(run));
        let same = |run: usize| {
            let standing = self.members[run].standing;
            (self.those(|member| member.standing == standing), standing)
        };
        let Some((runs, standing)) = each(open).map(same).reduce(most) else { return };
        self.part(open & !runs);
        match standing {
            Standing::Event(cause) => self.decide(runs, |regime| regime.change(cause)),
            _ => {
                each(runs).for_each(|run| self.members[run].segment += 1);
                self.decide(runs, |regime| regime.refresh());
            }
        }
    }

    /// Let an event within round-off of a knot happen there.
    fn move_to_knot(&mut self, run: usize) {
        let (member, t) = (&mut self.members[run], &mut self.regime.t.0[run]);
        if let Standing::Event(cause) = member.standing
            && let Some(next) = member.inputs.just_before(member.segment, *t)
        {
            (member.segment, *t) = (next, member.inputs.knot(next));
            member.standing = Standing::Event(cause.at_knot());
        }
    }

    /// Let runs decide together, by the inputs about their instants.
    fn decide<E>(&mut self, runs: u32, act: impl FnOnce(&mut Regime<'_, Lanes>) -> Result<(), E>) {
        if runs == 0 {
            return;
        }
        self.take_inputs(runs);
        let (result, parting) = together(runs, || act(&mut self.regime));
        // Splits of torque are decided anew at every sample, each run at its own.
        let all = result.is_err() || self.regime.is_split();
        self.part(if all { runs } else { parting });
        each(self.open()).for_each(|run| self.settle(run));
    }

    /// Inputs about the present instants.
    fn take_inputs(&mut self, runs: u32) {
        let Regime { expansion, t, remaining, .. } = &mut self.regime;
        for run in each(runs) {
            let Member { inputs, segment, .. } = self.members[run];
            inputs.expand(segment, t.0[run], &mut self.own_inputs);
            for (to, own) in expansion.inputs.iter_mut().zip(&self.own_inputs) {
                to[0].0[run] = own[0];
                to[1].0[run] = own[1];
            }
            remaining.0[run] = inputs.span(segment).1 - t.0[run];
        }
    }

    /// See where a run stands now that it has got on.
    fn settle(&mut self, run: usize) {
        let (member, t) = (&mut self.members[run], self.regime.t.0[run]);
        let segments = member.inputs.segments();
        if member.segment < segments {
            let (from, to) = member.inputs.span(member.segment);
            member.segment += usize::from(t >= to && from < to);
        }
        if member.segment == segments {
            member.standing = Standing::Ended;
            self.events[run] = Some(self.regime.events.iter().map(|e| e.of_run(run)).collect());
            return;
        }
        let (from, to) = member.inputs.span(member.segment);
        member.standing = match (from == to, t == from) {
            (true, _) => Standing::Jump,
            (false, true) => Standing::Ahead,
            (false, false) => Standing::Due,
        };
    }

    /// Pass samples with those that stand before some; false where there are none.
    fn pass_samples(&mut self, record: &mut impl Record) -> bool {
        self.vent();
        let ahead = self.those(|member| member.standing == Standing::Ahead);
        let Some(first) = each(ahead).map(|run| self.members[run].segment).min() else {
            return false;
        };
        let h = self.members[0].inputs.usual_length(first, self.settings.max_step);
        let (ready, parting) = together(self.open(), || self.regime.ready(h?));
        if parting != 0 {
            self.part(parting);
            return true;
        }
        let (Some(ready), Some(h)) = (ready, h) else {
            for run in each(ahead) {
                if self.members[run].segment == first {
                    self.members[run].standing = Standing::Due;
                }
            }
            return true;
        };
        let Self { regime, members, columns, .. } = self;
        let passage = Passage { regime, members, active: &ready.active, h, columns };
        let arrived = match &ready.operators {
            AnySize::Four(operators) => passage.pass(operators, record),
            _ => unreachable!("more states are of one run"),
        };
        each(arrived).for_each(|run| self.settle(run));
        true
    }

    /// Let what has no load from the sample on that a run stands before vent there.
    fn vent(&mut self) {
        let line = |run: usize, input: usize| match self.members.get(run) {
            Some(member) if member.standing == Standing::Ahead => {
                member.inputs.lines(member.segment)[input]
            }
            // Of the others nothing is gone, whatever the gain.
            _ => [f64::NAN; 2],
        };
        let inputs = |input| [0, 1].map(|k| Lanes::gathered(|run| line(run, input)[k]));
        if let Some((j, runs)) = self.regime.gone(inputs) {
            let standing = Standing::Event(Cause::Pressed(j));
            each(runs).for_each(|run| self.members[run].standing = standing);
        }
    }

    /// Expand the motion of runs, each to its next event or to the end of its segment.
    fn expand(&mut self, runs: u32, record: &mut impl Record) {
        self.take_inputs(runs);
        let none = Lanes::zero_();
        let remaining = none.with(runs, self.regime.remaining);
        let wish = remaining.smaller(Lanes::of(self.settings.max_step));
        let accuracy = self.settings.accuracy(true);
        let ((h, events), parting) = together(runs, || {
            let h = self.regime.expand(runs, (wish, accuracy));
            (h, earliest_of_each(&self.regime, (runs, h)))
        });
        let mut lengths = h;
        for run in each(runs) {
            let (own, left) = (&mut lengths.0[run], remaining.0[run]);
            *own = events[run].map_or(if *own >= left { left } else { *own }, |(at, _)| at);
        }
        self.record_start(runs & lengths.those(|length| length > 0.0), record);
        self.regime.move_on(runs, lengths);
        self.part(parting);
        let (mut at, last) = (0, self.members[0].inputs.segments());
        for run in each(runs & !parting) {
            let whole = h.0[run] >= remaining.0[run];
            let event = events[run].map(|(_, cause)| cause);
            self.step(run, (lengths.0[run], h.0[run]), whole, event);
            at |= u32::from(self.members[run].standing == Standing::Ended) << run;
        }
        if at != 0 {
            record.reached(&self.regime, (at, &[last; WIDTH]), lengths);
        }
    }

    /// Record the samples at which runs start.
    fn record_start(&self, runs: u32, record: &mut impl Record) {
        let mut at = (0, [0; WIDTH]);
        for run in each(runs) {
            let Member { inputs, segment, .. } = self.members[run];
            at.0 |= u32::from(self.regime.t.0[run] == inputs.knot(segment)) << run;
            at.1[run] = segment;
        }
        if at.0 != 0 {
            record.reached(&self.regime, (at.0, &at.1), Lanes::zero_());
        }
    }

    /// Let a run take the step that it has expanded: its length, the length it could have had [s], whether it
    /// leads to the end of the segment, and the event that ends it.
    fn step(&mut self, run: usize, (length, h): (f64, f64), whole: bool, event: Option<Cause>) {
        let (member, t) = (&mut self.members[run], &mut self.regime.t.0[run]);
        let end = member.inputs.span(member.segment).1;
        *t = if whole && event.is_none() { end } else { *t + length };
        let finite = self.regime.x.iter().all(|x| x.0[run].is_finite());
        let advances = member.progress.note((*t, length), event.is_some()).is_ok();
        let lost = is_lost(h, end) && !whole;
        if lost || !finite || !advances || member.progress.is_stalled() {
            member.standing = Standing::Parted;
        } else if let Some(cause) = event {
            member.standing = Standing::Event(cause);
        } else {
            self.settle(run);
        }
    }
}

/// What more runs have in common, a number of bits.
fn most<S>(one: (u32, S), other: (u32, S)) -> (u32, S) {
    if other.0.count_ones() > one.0.count_ones() { other } else { one }
}

/// Runs for which the answer is yes, as bits.
pub fn bits(answers: impl Iterator<Item = bool>) -> u32 {
    answers.enumerate().fold(0, |bits, (run, answer)| bits | u32::from(answer) << run)
}

/// Numbers of the runs in a set of bits.
pub(super) fn each(mut runs: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let run = (runs != 0).then(|| runs.trailing_zeros() as usize);
        runs &= runs.wrapping_sub(1);
        run
    })
}
