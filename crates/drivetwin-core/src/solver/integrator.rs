// SPDX-License-Identifier: MIT
//! The main loop: expand, find the first event, advance, change the mode.

use crate::number::Real;
use crate::solver::cache::SolverCache;
use crate::solver::exponential::plan::supports_fixed_step;
use crate::solver::exponential::propagator_cache::PropagatorCache;
use crate::solver::exponential::samples::SampleColumn;
use crate::solver::hybrid::event::EventCause;
use crate::solver::hybrid::event_search::earliest;
use crate::solver::hybrid::stall::{Stall, StallDetector, underflows};
use crate::solver::hybrid::state::HybridState;
use crate::solver::hybrid::stiffness::{ExpandedStep, Stiffness};
use crate::solver::inputs::Inputs;
use crate::solver::interrupt::is_interrupted;
use crate::solver::settings::{Settings, Step};
use crate::solver::single::SampleSink;
use crate::solver::status::Status;
use crate::solver::tolerances::{RUNAWAY, STALL_NUDGE};
use std::sync::Arc;

/// A run in progress.
pub struct Integrator<'a, T: Real> {
    /// State and friction modes.
    pub state: HybridState<'a, T>,
    /// Time [s] and element of the first event that only grazed its guard.
    pub grazing: Option<(f64, String)>,
    pub(crate) inputs: Arc<Inputs<T>>,
    pub(crate) settings: Settings,
    /// True if propagators pass whole samples.
    uses_fixed_step: bool,
    /// Working space of fixed steps.
    pub(crate) trail: Vec<SampleColumn<T>>,
    pub(crate) segment: usize,
    /// Speed of the fastest member at the start, rad/s.
    fastest: f64,
    /// True until the run advances with other inputs.
    continued: bool,
    /// Propagators, including those of this run.
    pub(crate) propagators: PropagatorCache<T>,
    pending: Option<EventCause>,
    progress: StallDetector,
    stiffness: Stiffness<T>,
}

impl<'a, T: Real> Integrator<'a, T> {
    /// Start at state `x` with the elements `locked` brought to zero slip; which of these hold is
    /// decided by their capacities.
    pub fn start(
        cache: SolverCache<'a, T>,
        inputs: Arc<Inputs<T>>,
        settings: Settings,
        x: Vec<T>,
        locked: &[usize],
    ) -> Result<Self, Status> {
        let SolverCache { network, modes, propagators } = cache;
        let (from, to) = inputs.span(0);
        let mut state = HybridState::start(network, modes, x, T::of(from))?;
        state.remaining = T::of(to - from);
        inputs.expand(0, state.t, &mut state.expansion.inputs);
        state.engage_initial(locked)?;
        let speeds = state.x[..network.speeds()].iter();
        let fastest = speeds.fold(0.0, |fastest: f64, v| fastest.max(v.re().abs()));
        Ok(Self {
            grazing: None,
            propagators,
            uses_fixed_step: settings.exponential_steps
                && inputs.has_samples()
                && supports_fixed_step(state.network),
            inputs,
            settings,
            state,
            trail: Vec::new(),
            segment: 0,
            fastest,
            continued: false,
            pending: None,
            progress: StallDetector::from(from),
            stiffness: Stiffness::new(),
        })
    }

    /// Return the cache for the next run of the network.
    pub fn into_cache(self) -> SolverCache<'a, T> {
        let HybridState { network, modes, .. } = self.state;
        SolverCache { network, modes, propagators: self.propagators }
    }

    /// Continue a run at its end with other inputs, which begin there.
    pub(crate) fn continue_with(&mut self, rewrite: impl FnOnce(&mut Inputs<T>)) {
        rewrite(Arc::make_mut(&mut self.inputs));
        (self.segment, self.continued) = (0, true);
        self.load_inputs();
    }

    /// Time reached, s.
    pub fn time(&self) -> T {
        self.state.t
    }

    /// Advance to the next input sample or event; `None` at the end of the inputs. Where the settings
    /// allow it, whole samples without events are passed first and handed to `sink`.
    pub fn advance(&mut self, sink: &mut impl SampleSink<T>) -> Result<Option<Step<T>>, Status> {
        if is_interrupted() {
            return Err(Status::Interrupted { time: self.state.time() });
        }
        self.change_mode()?;
        if !self.enter_segment()? {
            return Ok(None);
        }
        if self.settings.exponential_steps {
            self.run_fixed_steps(sink)?;
            if self.is_at_end() {
                return self.check_massless().map(|()| None);
            }
        }
        self.expand_step().map(Some)
    }

    /// One expansion, a Taylor series or an implicit step: to the next input sample or event.
    fn expand_step(&mut self) -> Result<Step<T>, Status> {
        let end = self.inputs.span(self.segment).1;
        let state = &mut self.state;
        let remaining = (-state.t + end).re();
        let wish = remaining.min(self.settings.max_step);
        let accuracy = self.settings.accuracy(self.uses_fixed_step);
        let ExpandedStep { length: h, work } = self.stiffness.expand(state, wish, accuracy);
        let lost = underflows(h, end) || (h < wish && !self.progress.add_work(state.time(), work));
        if lost && h < remaining {
            return Err(Status::StepTooSmall { time: state.time() });
        }
        let event = match self.progress.is_stalled() {
            true => Some((T::of(h.min(STALL_NUDGE)), EventCause::Stalled, false)),
            false => earliest(state, h),
        };
        let start = state.t;
        let length = match event {
            Some((at, ..)) => at,
            None if h >= remaining => -state.t + end,
            None => T::of(h),
        };
        self.pending = event.map(|(_, cause, _)| cause);
        if event.is_some() {
            self.stiffness.note_event();
        }
        if let (Some((at, cause, true)), None) = (event, &self.grazing) {
            self.grazing = Some(((start + at).re(), state.element_name_of(cause)));
        }
        state.advance_state(1, length);
        state.t = if event.is_none() && h >= remaining { T::of(end) } else { start + length };
        state.released.iter_mut().for_each(|r| *r &= length.re() == 0.0);
        self.check_progress(length.re())?;
        Ok(Step { start, length })
    }

    /// Carry out what the last event caused.
    fn change_mode(&mut self) -> Result<(), Status> {
        let Some(mut cause) = self.pending.take() else { return Ok(()) };
        let time = self.state.t.re();
        if let Some(next) = self.inputs.just_before(self.segment, time) {
            self.state.t += self.inputs.knot(next) - time;
            self.segment = next;
            cause = cause.move_to_knot();
        }
        self.load_inputs();
        self.state.change(cause)
    }

    /// Step into the next segment where the present one is used up; false at the end.
    fn enter_segment(&mut self) -> Result<bool, Status> {
        let mut entered = std::mem::take(&mut self.continued);
        let mut jumped = false;
        while self.state.t.re() >= self.inputs.span(self.segment).1 {
            if self.segment + 1 == self.inputs.segments() {
                return Ok(false);
            }
            // Samples may also have been passed up to the jump.
            let (from, to) = self.inputs.span(self.segment);
            jumped |= from == to;
            self.segment += 1;
            entered = true;
        }
        self.load_inputs();
        // Where a prescribed acceleration jumps, everything that holds against it is decided anew.
        if jumped || (entered && !self.state.network.prescribed.is_empty()) {
            self.state.refresh()?;
        } else {
            self.vent_unloaded()?;
            if entered && self.state.is_split() {
                self.state.decide(None)?;
            }
        }
        Ok(true)
    }

    /// Vent what has no load from here on.
    fn vent_unloaded(&mut self) -> Result<(), Status> {
        loop {
            let inputs = &self.state.expansion.inputs;
            let gone =
                self.state.find_unloaded(|input| [inputs[input][0].re(), inputs[input][1].re()]);
            match gone {
                Some((j, _)) => self.state.change(EventCause::LoadOnset(j))?,
                None => return Ok(()),
            }
        }
    }

    /// Inputs about the present instant.
    pub(crate) fn load_inputs(&mut self) {
        let state = &mut self.state;
        self.inputs.expand(self.segment, state.t, &mut state.expansion.inputs);
        state.remaining = T::of(self.inputs.span(self.segment).1 - state.t.re());
    }

    /// Refuse the motion of a member without mass that no friction element follows.
    fn check_massless(&self) -> Result<(), Status> {
        let HybridState { network, x, .. } = &self.state;
        let speed = |i: usize| x[i].re().abs();
        for &j in &network.massless {
            let others = (0..network.speeds()).filter(|i| !network.massless.contains(i));
            let fastest = others.map(speed).fold(self.fastest, f64::max);
            if speed(j) > RUNAWAY * (1.0 + fastest) {
                let member = &network.mechanism.nodes[network.coordinates.independent[j]];
                let (time, member) = (self.state.time(), member.to_string());
                return Err(Status::Runaway { time, member });
            }
        }
        Ok(())
    }

    fn check_progress(&mut self, length: f64) -> Result<(), Status> {
        let time = self.state.t.re();
        if !self.state.x.iter().all(|v| v.re().is_finite()) {
            return Err(Status::NotFinite { time });
        }
        self.check_massless()?;
        self.progress.note(time, length, self.pending.is_some()).map_err(|lack| match lack {
            Stall::TooSmall => Status::StepTooSmall { time },
            Stall::Zeno => {
                let element =
                    self.pending.map_or_else(String::new, |c| self.state.element_name_of(c));
                Status::Chattering { time, element }
            }
        })
    }

    /// Times of all knots of the inputs, s; they have one more than segments.
    pub fn knots(&self) -> &[f64] {
        self.inputs.knots()
    }

    /// Value of an input at a knot.
    #[inline(always)]
    pub fn input_at(&self, i: usize, input: usize) -> T {
        self.inputs.knot_value(i, input)
    }

    /// Return true at the end of the inputs.
    pub fn is_at_end(&self) -> bool {
        self.state.t.re() >= self.inputs.knot(self.inputs.segments())
    }
}
