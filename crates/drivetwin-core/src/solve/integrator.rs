// SPDX-License-Identifier: MIT
//! The main loop: expand, find the first event, advance, change the mode.

use super::expansion::{Accuracy, Expansion};
use super::guard::{Cause, Watch, earliest};
use super::inputs::Inputs;
use super::known::Known;
use super::march::Column;
use super::sprint::{Sink, can_march};
use super::status::Status;
use crate::network::channel::ChannelSeries;
use crate::network::{Cell, GearState, Mode, ModeKey, Network, Row};
use crate::number::{Real, Series, TERMS};
use std::sync::Arc;

/// Friction mode of one element (paper eqs. 4-6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowState {
    /// No capacity.
    Open,
    /// Slip in one direction.
    Slipping {
        /// Sign of the slip and of the torque.
        sign: f64,
    },
    /// No slip, torque within the static capacity.
    Stuck,
    /// No slip because other elements hold the same speeds; torque at the static capacity.
    Saturated {
        /// Sign of the torque.
        sign: f64,
    },
}

/// What happened at an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Slip came to rest.
    Lock,
    /// The holding torque exceeded the static capacity.
    BreakAway,
    /// Slip passed through zero.
    Reverse,
    /// The pressure rose above the fill pressure.
    Fill,
    /// The pressure fell below the fill pressure.
    Vent,
}

/// A change of friction mode.
#[derive(Clone, Debug)]
pub struct Event<T> {
    /// When, s; carries derivatives.
    pub time: T,
    /// Index of the friction element, or after these of the lossy gear.
    pub element: usize,
    /// What.
    pub kind: EventKind,
}

/// Accuracy of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Truncation error allowed per step, relative to the states; [`AMID_SAMPLES`] at least where a run
    /// passes samples by operators.
    pub tolerance: f64,
    /// Longest step, s.
    pub max_step: f64,
    /// Fixed order instead of one that follows the tolerance; for convergence studies.
    pub order: Option<usize>,
    /// Pass samples without events by exact operators, with slipping torques as cubics in time:
    /// several times faster at an error of a few 1e-3 N·m on 1 ms samples.
    pub sprint: bool,
}

impl Settings {
    /// Round-off accuracy throughout.
    pub fn exact() -> Self {
        Self { sprint: false, ..Self::default() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self { tolerance: 1e-12, max_step: f64::INFINITY, order: None, sprint: true }
    }
}

/// Truncation error allowed in steps between samples that are passed by operators, whose own error is
/// larger.
pub const AMID_SAMPLES: f64 = 1e-8;

/// One step: the expansion of the integrator holds from `start` for `length` seconds.
#[derive(Clone, Copy, Debug)]
pub struct Step<T> {
    /// Start, s.
    pub start: T,
    /// Length, s; zero at coincident events.
    pub length: T,
}

/// Steps without progress after which the run moves on by [`NUDGE`] and decides anew.
const MAX_STALLED: usize = 20;
/// Time that a stalled run moves on, s.
const NUDGE: f64 = 1e-10;
/// Events over which a run must advance by at least [`MIN_PROGRESS`].
const PROGRESS_WINDOW: usize = 1000;
/// Least advance over a window of events, s; below lies Zeno behaviour.
const MIN_PROGRESS: f64 = 1e-7;

/// Steps over which a run must advance by at least [`MIN_ADVANCE`].
const STEP_WINDOW: usize = 10_000;
/// Least advance over a window of steps, s; below, the motion is too stiff or has blown up.
const MIN_ADVANCE: f64 = 1e-3;

/// A run in progress.
pub struct Integrator<'a, T> {
    /// Network.
    pub network: &'a Network<T>,
    /// State (speeds, twists) at the end of the last step.
    pub x: Vec<T>,
    /// Friction modes during the last step.
    pub rows: Vec<RowState>,
    /// Active mode during the last step.
    pub mode: Arc<Mode<T>>,
    /// Expansion of the last step.
    pub expansion: Expansion<T>,
    /// Events so far.
    pub events: Vec<Event<T>>,
    /// Time [s] and element of the first event that only grazed its guard.
    pub grazing: Option<(f64, String)>,
    pub(super) t: T,
    pub(super) cells: Vec<Cell>,
    pub(super) released: Vec<bool>,
    pub(super) pressed: Vec<bool>,
    /// Whether a gear that carries all it can is kept from rolling by others.
    pub(super) blocked: Vec<bool>,
    /// Inputs and state as decisions see them.
    pub(super) ahead: Vec<Series<T>>,
    pub(super) x_ahead: Vec<T>,
    pub(super) channel_ahead: ChannelSeries<T>,
    /// States of lossy gears during the last step.
    pub gears: Vec<GearState>,
    pub(super) inputs: &'a Inputs<T>,
    pub(super) settings: Settings,
    /// Whether samples are passed by operators.
    marches: bool,
    /// Working space of a march.
    pub(super) trail: Vec<Column<T>>,
    /// Modes and operators, also those of this run.
    pub known: Known<'a, T>,
    pub(super) segment: usize,
    pub(super) pending: Option<Cause>,
    stalled: usize,
    window: (usize, f64),
    /// Steps since, and time of, the last look at the advance.
    steps: (usize, f64),
}

impl<'a, T: Real> Integrator<'a, T> {
    /// Start at state `x` with the elements `locked` brought to zero slip; which of these hold is
    /// decided by their capacities.
    pub fn start(
        mut known: Known<'a, T>,
        inputs: &'a Inputs<T>,
        settings: Settings,
        (x, locked): (Vec<T>, &[usize]),
    ) -> Result<Self, Status> {
        let network = known.network;
        let t = inputs.span(0).0;
        let frictions = network.frictions.len();
        let key = ModeKey::default();
        let mode =
            known.known_mode(key).or_else(|| known.new_mode(key, &vec![T::zero_(); frictions]));
        let mode = mode.ok_or_else(|| self_locking(network, t))?;
        let mut run = Self {
            rows: vec![RowState::Open; frictions],
            expansion: Expansion::new(network),
            events: Vec::new(),
            grazing: None,
            t: T::of(t),
            cells: vec![Cell::Off; network.channels.len()],
            released: vec![false; frictions + network.losses.len()],
            pressed: vec![false; frictions],
            blocked: vec![false; network.losses.len()],
            x_ahead: x.clone(),
            channel_ahead: ChannelSeries::default(),
            x,
            ahead: vec![[T::zero_(); TERMS]; network.mechanism.inputs.len()],
            gears: vec![GearState::Rolling { sign: 1.0, backward: false }; network.losses.len()],
            network,
            inputs,
            marches: settings.sprint && inputs.is_sampled() && can_march(network),
            settings,
            mode,
            trail: Vec::new(),
            known,
            segment: 0,
            pending: None,
            stalled: 0,
            window: (0, t),
            steps: (0, t),
        };
        let locked: Vec<Row> = locked.iter().map(|&j| Row::Friction(j)).collect();
        run.take_up(&locked)?;
        run.events.clear();
        Ok(run)
    }

    /// Time reached, s.
    pub fn time(&self) -> T {
        self.t
    }

    /// Advance to the next input sample or event; `None` at the end of the inputs. Where the settings
    /// allow it, whole samples without events are passed first and handed to `sink`.
    pub fn advance(&mut self, sink: &mut impl Sink<T>) -> Result<Option<Step<T>>, Status> {
        if !self.take_up_next()? {
            return Ok(None);
        }
        if self.settings.sprint {
            self.sprint(sink);
            if self.is_at_end() {
                return Ok(None);
            }
        }
        self.expand_step().map(Some)
    }

    /// Change the mode after an event and enter the next segment; false at the end of the inputs.
    pub(super) fn take_up_next(&mut self) -> Result<bool, Status> {
        self.change_mode()?;
        self.enter_segment()
    }

    /// One Taylor expansion: to the next input sample or event.
    pub(super) fn expand_step(&mut self) -> Result<Step<T>, Status> {
        let end = self.inputs.span(self.segment).1;
        let remaining = (-self.t + end).re();
        let wish = remaining.min(self.settings.max_step);
        let least = if self.marches { AMID_SAMPLES } else { 0.0 };
        let tolerance = self.settings.tolerance.max(least);
        let accuracy = Accuracy { tolerance, order: self.settings.order };
        let mode = Arc::clone(&self.mode);
        let (cells, x) = (&self.cells, &self.x);
        let h = self.expansion.expand(self.network, &mode, cells, x, (wish, accuracy));
        if h < 1e-14 * (1.0 + end.abs()) && h < remaining {
            return Err(Status::StepTooSmall { time: self.t.re() });
        }
        let stalled = self.stalled >= MAX_STALLED;
        let event = match stalled {
            true => Some((T::of(h.min(NUDGE)), Cause::Stalled, false)),
            false => earliest(&self.watch(&mode), &self.expansion, h),
        };
        let start = self.t;
        let length = match event {
            Some((at, ..)) => at,
            None if h >= remaining => -self.t + end,
            None => T::of(h),
        };
        self.pending = event.map(|(_, cause, _)| cause);
        if let (Some((at, cause, true)), None) = (event, &self.grazing) {
            self.grazing = Some(((start + at).re(), self.culprit(cause)));
        }
        self.expansion.state_at(length, &mut self.x);
        self.t = if event.is_none() && h >= remaining { T::of(end) } else { start + length };
        self.released.iter_mut().for_each(|r| *r &= length.re() == 0.0);
        self.check_progress(length.re())?;
        Ok(Step { start, length })
    }

    /// Time of a knot of the inputs, s; they have one more than segments.
    pub fn knot(&self, i: usize) -> f64 {
        self.inputs.knot(i)
    }

    /// Times of all knots, s.
    pub fn knots(&self) -> &'a [f64] {
        self.inputs.knots()
    }

    /// Whether the run may pass samples side by side with others of its kind.
    pub fn can_sprint(&self) -> bool {
        self.settings.sprint && self.x.len() <= 8
    }

    /// Value of an input at a knot.
    #[inline(always)]
    pub fn input_at(&self, i: usize, input: usize) -> T {
        if i < self.inputs.segments() {
            return self.inputs.line(i, input)[0];
        }
        let [start, rate] = self.inputs.line(i - 1, input);
        start + rate * (self.inputs.knot(i) - self.inputs.knot(i - 1))
    }

    /// Whether the inputs end here.
    pub fn is_at_end(&self) -> bool {
        self.t.re() >= self.inputs.knot(self.inputs.segments())
    }

    /// Mode of a key, compiled once.
    pub(super) fn mode(&mut self, key: ModeKey) -> Result<Arc<Mode<T>>, Status> {
        if let Some(mode) = self.known.known_mode(key) {
            return Ok(mode);
        }
        let mode = self.known.new_mode(key, &self.capacities());
        mode.ok_or_else(|| self_locking(self.network, self.t.re()))
    }

    fn watch<'w>(&'w self, mode: &'w Mode<T>) -> Watch<'w, T> {
        Watch {
            network: self.network,
            mode,
            rows: &self.rows,
            released: &self.released,
            cells: &self.cells,
            pressed: &self.pressed,
            blocked: &self.blocked,
            gears: &self.gears,
        }
    }

    /// Step into the next segment where the present one is used up; false at the end.
    fn enter_segment(&mut self) -> Result<bool, Status> {
        let (mut entered, mut jumped) = (false, false);
        while self.t.re() >= self.inputs.span(self.segment).1 {
            if self.segment + 1 == self.inputs.segments() {
                return Ok(false);
            }
            self.segment += 1;
            entered = true;
            let (from, to) = self.inputs.span(self.segment);
            jumped |= from == to;
        }
        self.inputs.expand(self.segment, self.t, &mut self.expansion.inputs);
        // Where a prescribed acceleration jumps, everything that holds against it is decided anew.
        if jumped || (entered && !self.network.prescribed.is_empty()) {
            self.refresh()?;
        } else if entered {
            self.refresh_split()?;
        }
        Ok(true)
    }

    fn check_progress(&mut self, length: f64) -> Result<(), Status> {
        let time = self.t.re();
        if !self.x.iter().all(|v| v.re().is_finite()) {
            return Err(Status::NotFinite { time });
        }
        self.steps.0 += 1;
        if self.steps.0 == STEP_WINDOW {
            if time - self.steps.1 < MIN_ADVANCE {
                return Err(Status::StepTooSmall { time });
            }
            self.steps = (0, time);
        }
        let Some(cause) = self.pending else {
            self.stalled = 0;
            return Ok(());
        };
        self.stalled = if length > 1e-13 * (1.0 + time.abs()) { 0 } else { self.stalled + 1 };
        self.window.0 += 1;
        let mut creeping = false;
        if self.window.0 == PROGRESS_WINDOW {
            creeping = time - self.window.1 < MIN_PROGRESS;
            self.window = (0, time);
        }
        if creeping {
            return Err(Status::Chattering { time, element: self.culprit(cause) });
        }
        Ok(())
    }

    fn culprit(&self, cause: Cause) -> String {
        let row = match cause {
            Cause::AtRest(row) | Cause::Overload(row, _) => row,
            Cause::Pressed(j) => Row::Friction(j),
            Cause::PowerReversal(i) => Row::Gear(i),
            Cause::Border(channel, _) if channel < self.rows.len() => Row::Friction(channel),
            Cause::Border(channel, _) => return format!("torque law {channel}"),
            Cause::Stalled => return "several elements at once".to_owned(),
        };
        self.network.element_of(row).to_owned()
    }

    /// Position of a row in lists that hold friction elements first, then lossy gears.
    pub(super) fn index_of(&self, row: Row) -> usize {
        match row {
            Row::Friction(j) => j,
            Row::Gear(i) => self.rows.len() + i,
        }
    }
}

/// Sign with zero counted as positive.
pub(super) fn sign_of(value: f64) -> f64 {
    if value < 0.0 { -1.0 } else { 1.0 }
}

fn self_locking<T>(network: &Network<T>, time: f64) -> Status {
    let element = network.losses.first().map_or_else(String::new, |l| l.element.to_string());
    Status::SelfLocking { time, element }
}
