// SPDX-License-Identifier: MIT
//! Several runs side by side as one, over packs of numbers.
//!
//! Every run advances to its next event: whole samples together with the others, the rest by Taylor
//! expansions of its own time. Where all have come to the same event they decide together. A run that
//! meets another event, or decides otherwise, parts: it has to be run again in other company or alone. No
//! operation mixes runs: a result depends neither on the neighbours nor on their number.

use crate::number::{KernelFloat, Number, Series, TERMS, Values, with_consensus};
use crate::solver::cache::SolverCache;
use crate::solver::exponential::plan::{supports_fixed_step, supports_lockstep};
use crate::solver::exponential::propagator::MAX_ACTIVE;
use crate::solver::exponential::propagator_cache::{PropagatorCache, SizedPropagator};
use crate::solver::exponential::samples::SampleColumn;
use crate::solver::hybrid::event::{Event, EventCause};
use crate::solver::hybrid::event_search::earliest_per_lane;
use crate::solver::hybrid::stall::{StallDetector, underflows};
use crate::solver::hybrid::state::HybridState;
use crate::solver::hybrid::stiffness::ShortenedSteps;
use crate::solver::inputs::Inputs;
use crate::solver::interrupt::is_interrupted;
use crate::solver::lane_mask::{lane_mask, lanes_in};
use crate::solver::lockstep::fixed_step::FixedStepPass;
use crate::solver::lockstep::lane::{LANES, LaneRun, LaneSink, LaneStatus, Lanes};
use crate::solver::settings::Settings;

/// Lanes in one hybrid state.
struct LockstepBatch<'a> {
    state: HybridState<'a, Lanes>,
    propagators: PropagatorCache<Lanes>,
    settings: Settings,
    /// True if propagators pass whole samples.
    uses_fixed_step: bool,
    lanes: Vec<LaneRun<'a>>,
    /// Events of those that have come to their end.
    events: Vec<Option<Vec<Event<f64>>>>,
    /// Working space of passages.
    columns: Vec<SampleColumn<Lanes>>,
    /// Inputs of one run.
    own_inputs: Vec<Series<f64>>,
}

/// Bring runs over the same knots to their ends: the runs `runs`, as bits, with these inputs, from states `x`
/// with the elements `locked` at rest. Returns the events of every run, nothing for one that has parted.
pub fn run_lockstep<'a>(
    cache: SolverCache<'a, Lanes>,
    inputs: &[&'a Inputs<f64>],
    settings: Settings,
    runs: u32,
    x: Vec<Lanes>,
    locked: &[usize],
    record: &mut impl LaneSink,
) -> Vec<Option<Vec<Event<f64>>>> {
    let events = vec![None; inputs.len()];
    if !settings.exponential_steps || !supports_lockstep(cache.network) {
        return events;
    }
    let uses_fixed_step = supports_fixed_step(cache.network);
    let SolverCache { network, modes, propagators } = cache;
    let start = inputs[0].knot(0);
    let (state, diverged_mask) =
        with_consensus(runs, || HybridState::start(network, modes, x, Lanes::of(start)));
    let Ok(state) = state else { return events };
    let lane = |(run, &inputs): (usize, &&'a Inputs<f64>)| {
        let status =
            if runs >> run & 1 == 1 { LaneStatus::NeedsTaylorStep } else { LaneStatus::Diverged };
        LaneRun {
            inputs,
            segment: 0,
            status,
            progress: StallDetector::from(start),
            shortened: ShortenedSteps::default(),
        }
    };
    let lanes = inputs.iter().enumerate().map(lane).collect();
    let own_inputs = vec![[0.0; TERMS]; state.inputs_plus.len()];
    let columns = Vec::with_capacity(state.x.len() + MAX_ACTIVE);
    let mut all = LockstepBatch {
        state,
        propagators,
        settings,
        uses_fixed_step,
        lanes,
        events,
        columns,
        own_inputs,
    };
    all.evict(diverged_mask);
    all.decide(all.open(), |state| state.engage_initial(locked));
    while all.open() != 0 && !is_interrupted() {
        all.advance(record);
        all.change();
    }
    all.events
}

impl LockstepBatch<'_> {
    /// Runs of which `say` holds, as bits.
    fn lanes_where(&self, say: impl Fn(&LaneRun<'_>) -> bool) -> u32 {
        lane_mask(self.lanes.iter().map(say))
    }

    /// Runs that are still on their way.
    fn open(&self) -> u32 {
        self.lanes_where(|lane| lane.status.is_open())
    }

    fn evict(&mut self, runs: u32) {
        lanes_in(runs).for_each(|run| self.lanes[run].status = LaneStatus::Diverged);
    }

    /// Bring every run to its next event or to its end.
    fn advance(&mut self, record: &mut impl LaneSink) {
        loop {
            while self.pass_samples(record) {}
            let due = self.lanes_where(|lane| lane.status == LaneStatus::NeedsTaylorStep);
            if due == 0 {
                return;
            }
            self.expand(due, record);
            // What was released has moved off in all of them: nobody passes samples with it.
            self.state.released.fill(false);
        }
    }

    /// Carry out the event at which most runs are; the others part.
    fn change(&mut self) {
        let open = self.open();
        lanes_in(open).for_each(|run| self.move_to_knot(run));
        let same = |run: usize| {
            let status = self.lanes[run].status;
            (self.lanes_where(|lane| lane.status == status), status)
        };
        let Some((runs, status)) = lanes_in(open).map(same).reduce(most) else { return };
        self.evict(open & !runs);
        match status {
            LaneStatus::Event(cause) => self.decide(runs, |state| state.change(cause)),
            _ => {
                lanes_in(runs).for_each(|run| self.lanes[run].segment += 1);
                self.decide(runs, |state| state.refresh());
            }
        }
    }

    /// Move an event within round-off of a knot to the knot.
    fn move_to_knot(&mut self, run: usize) {
        let (lane, t) = (&mut self.lanes[run], &mut self.state.t.0[run]);
        if let LaneStatus::Event(cause) = lane.status
            && let Some(next) = lane.inputs.just_before(lane.segment, *t)
        {
            (lane.segment, *t) = (next, lane.inputs.knot(next));
            lane.status = LaneStatus::Event(cause.move_to_knot());
        }
    }

    /// Decide for several lanes together, by the inputs at their instants.
    fn decide<E>(
        &mut self,
        runs: u32,
        act: impl FnOnce(&mut HybridState<'_, Lanes>) -> Result<(), E>,
    ) {
        if runs == 0 {
            return;
        }
        self.load_inputs(runs);
        let (result, diverged_mask) = with_consensus(runs, || act(&mut self.state));
        // Splits of torque are decided anew at every sample, each run at its own.
        let all = result.is_err() || self.state.is_split();
        self.evict(if all { runs } else { diverged_mask });
        lanes_in(self.open()).for_each(|run| self.update_lane_status(run));
    }

    /// Inputs about the present instants.
    fn load_inputs(&mut self, runs: u32) {
        let HybridState { expansion, t, remaining, .. } = &mut self.state;
        for run in lanes_in(runs) {
            let LaneRun { inputs, segment, .. } = self.lanes[run];
            inputs.expand(segment, t.0[run], &mut self.own_inputs);
            for (to, own) in expansion.inputs.iter_mut().zip(&self.own_inputs) {
                to[0].0[run] = own[0];
                to[1].0[run] = own[1];
            }
            remaining.0[run] = inputs.span(segment).1 - t.0[run];
        }
    }

    /// Update the status of a lane after it has advanced.
    fn update_lane_status(&mut self, run: usize) {
        let (lane, t) = (&mut self.lanes[run], self.state.t.0[run]);
        let segments = lane.inputs.segments();
        if lane.segment < segments {
            let (from, to) = lane.inputs.span(lane.segment);
            lane.segment += usize::from(t >= to && from < to);
        }
        if lane.segment == segments {
            lane.status = LaneStatus::Finished;
            self.events[run] = Some(self.state.events.iter().map(|e| e.extract_run(run)).collect());
            return;
        }
        let (from, to) = lane.inputs.span(lane.segment);
        lane.status = match (from == to, t == from) {
            (true, _) => LaneStatus::AtInputJump,
            (false, true) => LaneStatus::AtSample,
            (false, false) => LaneStatus::NeedsTaylorStep,
        };
    }

    /// Pass samples with those that stand before some; false where there are none.
    fn pass_samples(&mut self, record: &mut impl LaneSink) -> bool {
        self.vent_unloaded();
        let ahead = self.lanes_where(|lane| lane.status == LaneStatus::AtSample);
        let Some(first) = lanes_in(ahead).map(|run| self.lanes[run].segment).min() else {
            return false;
        };
        if !self.uses_fixed_step {
            lanes_in(ahead).for_each(|run| self.lanes[run].status = LaneStatus::NeedsTaylorStep);
            return false;
        }
        let h = self.lanes[0].inputs.usual_length(first, self.settings.max_step);
        let (plan, diverged_mask) =
            with_consensus(self.open(), || self.state.plan_steps(&mut self.propagators, &[], h?));
        if diverged_mask != 0 {
            self.evict(diverged_mask);
            return true;
        }
        let (Some(plan), Some(h)) = (plan, h) else {
            for run in lanes_in(ahead) {
                if self.lanes[run].segment == first {
                    self.lanes[run].status = LaneStatus::NeedsTaylorStep;
                }
            }
            return true;
        };
        let Self { state, lanes, columns, .. } = self;
        let passage = FixedStepPass { state, lanes, active: &plan.active, h, columns };
        // More states are of one run.
        let SizedPropagator::Four(operators) = &plan.operators else { return false };
        let arrived = passage.pass(operators, record);
        lanes_in(arrived).for_each(|run| self.update_lane_status(run));
        true
    }

    /// Let what has no load from the sample on that a run stands before vent there.
    fn vent_unloaded(&mut self) {
        let line = |run: usize, input: usize| match self.lanes.get(run) {
            Some(lane) if lane.status == LaneStatus::AtSample => {
                lane.inputs.lines(lane.segment)[input]
            }
            // Of the others nothing is gone, whatever the gain.
            _ => [f64::NAN; 2],
        };
        let inputs = |input| [0, 1].map(|k| Lanes::from_lanes(|run| line(run, input)[k]));
        if let Some((j, runs)) = self.state.find_unloaded(inputs) {
            let status = LaneStatus::Event(EventCause::LoadOnset(j));
            lanes_in(runs).for_each(|run| self.lanes[run].status = status);
        }
    }

    /// Expand the motion of runs, each to its next event or to the end of its segment.
    fn expand(&mut self, runs: u32, record: &mut impl LaneSink) {
        self.load_inputs(runs);
        let none = Lanes::zero_();
        let remaining = none.replace_where(runs, self.state.remaining);
        let wish = remaining.smaller(Lanes::of(self.settings.max_step));
        let accuracy = self.settings.accuracy(self.uses_fixed_step);
        let ((h, events), diverged_mask) = with_consensus(runs, || {
            let h = self.state.expand(runs, wish, accuracy);
            (h, earliest_per_lane(&self.state, runs, h))
        });
        let mut lengths = h;
        for run in lanes_in(runs) {
            let (own, left) = (&mut lengths.0[run], remaining.0[run]);
            *own = events[run].map_or(if *own >= left { left } else { *own }, |(at, _)| at);
        }
        self.record_start(runs & lengths.mask_where(|length| length > 0.0), record);
        self.state.advance_state(runs, lengths);
        self.evict(diverged_mask);
        let (mut at, last) = (0, self.lanes[0].inputs.segments());
        for run in lanes_in(runs & !diverged_mask) {
            let whole = h.0[run] >= remaining.0[run];
            let event = events[run].map(|(_, cause)| cause);
            let shortened = &mut self.lanes[run].shortened;
            shortened.note(h.0[run], wish.0[run]);
            if event.is_some() {
                shortened.note_event();
            }
            self.step(run, lengths.0[run], h.0[run], whole, event);
            at |= u32::from(self.lanes[run].status == LaneStatus::Finished) << run;
        }
        if at != 0 {
            record.write_sample(&self.state, at, &[last; LANES], lengths);
        }
    }

    /// Record the samples at which runs start.
    fn record_start(&self, runs: u32, record: &mut impl LaneSink) {
        let (mut at, mut knots) = (0, [0; LANES]);
        for run in lanes_in(runs) {
            let LaneRun { inputs, segment, .. } = self.lanes[run];
            at |= u32::from(self.state.t.0[run] == inputs.knot(segment)) << run;
            knots[run] = segment;
        }
        if at != 0 {
            record.write_sample(&self.state, at, &knots, Lanes::zero_());
        }
    }

    /// Let a run take the step that it has expanded: its length, the length it could have had [s], whether it
    /// leads to the end of the segment, and the event that ends it.
    fn step(&mut self, run: usize, length: f64, h: f64, whole: bool, event: Option<EventCause>) {
        let (lane, t) = (&mut self.lanes[run], &mut self.state.t.0[run]);
        let end = lane.inputs.span(lane.segment).1;
        *t = if whole && event.is_none() { end } else { *t + length };
        let finite = self.state.x.iter().all(|x| x.0[run].is_finite());
        let advances = lane.progress.note(*t, length, event.is_some()).is_ok();
        let lost = underflows(h, end) && !whole;
        let stuck = lane.progress.is_stalled() || lane.shortened.is_stiff();
        if lost || !finite || !advances || stuck {
            lane.status = LaneStatus::Diverged;
        } else if let Some(cause) = event {
            lane.status = LaneStatus::Event(cause);
        } else {
            self.update_lane_status(run);
        }
    }
}

/// The candidate with more runs in its mask, `one` if equal.
fn most<S>(one: (u32, S), other: (u32, S)) -> (u32, S) {
    if other.0.count_ones() > one.0.count_ones() { other } else { one }
}
