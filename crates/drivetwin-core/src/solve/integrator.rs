// SPDX-License-Identifier: MIT
//! The main loop: expand, find the first event, advance, change the mode.

use super::expansion::Accuracy;
use super::guard::{Cause, earliest};
use super::inputs::Inputs;
use super::known::Known;
use super::march::Column;
use super::progress::{Lack, Progress, is_lost};
use super::ready::can_march;
use super::regime::Regime;
use super::sprint::Sink;
use super::status::Status;
use crate::number::Real;

/// Accuracy of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Truncation error allowed per step, relative to the states; [`AMID_SAMPLES`] at least where a run
    /// passes samples by operators.
    pub tolerance: f64,
    /// Longest step, s.
    pub max_step: f64,
    /// Fixed order instead of one that follows the tolerance, from 1 to below
    /// [`TERMS`](crate::number::TERMS); for convergence studies.
    pub order: Option<usize>,
    /// Pass samples without events by exact operators, with slipping torques as cubics in time:
    /// several times faster at an error of a few 1e-3 N·m on 1 ms samples.
    pub sprint: bool,
}

impl Settings {
    /// Of expansions, also between samples that are passed by operators.
    pub(super) fn accuracy(&self, marches: bool) -> Accuracy {
        let least = if marches { AMID_SAMPLES } else { 0.0 };
        Accuracy { tolerance: self.tolerance.max(least), order: self.order }
    }

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

/// Time that a stalled run moves on, s.
const NUDGE: f64 = 1e-10;

/// A run in progress.
pub struct Integrator<'a, T: Real> {
    /// State and friction modes.
    pub regime: Regime<'a, T>,
    /// Time [s] and element of the first event that only grazed its guard.
    pub grazing: Option<(f64, String)>,
    pub(super) inputs: &'a Inputs<T>,
    pub(super) settings: Settings,
    /// Whether samples are passed by operators.
    marches: bool,
    /// Working space of a march.
    pub(super) trail: Vec<Column<T>>,
    pub(super) segment: usize,
    pending: Option<Cause>,
    progress: Progress,
}

impl<'a, T: Real> Integrator<'a, T> {
    /// Start at state `x` with the elements `locked` brought to zero slip; which of these hold is
    /// decided by their capacities.
    pub fn start(
        known: Known<'a, T>,
        inputs: &'a Inputs<T>,
        settings: Settings,
        (x, locked): (Vec<T>, &[usize]),
    ) -> Result<Self, Status> {
        let (from, to) = inputs.span(0);
        let mut regime = Regime::start(known, x, T::of(from))?;
        regime.remaining = T::of(to - from);
        inputs.expand(0, regime.t, &mut regime.expansion.inputs);
        regime.take_up(locked)?;
        Ok(Self {
            grazing: None,
            inputs,
            marches: settings.sprint && inputs.is_sampled() && can_march(regime.network),
            settings,
            regime,
            trail: Vec::new(),
            segment: 0,
            pending: None,
            progress: Progress::from(from),
        })
    }

    /// Time reached, s.
    pub fn time(&self) -> T {
        self.regime.t
    }

    /// Advance to the next input sample or event; `None` at the end of the inputs. Where the settings
    /// allow it, whole samples without events are passed first and handed to `sink`.
    pub fn advance(&mut self, sink: &mut impl Sink<T>) -> Result<Option<Step<T>>, Status> {
        self.change_mode()?;
        if !self.enter_segment()? {
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

    /// One Taylor expansion: to the next input sample or event.
    fn expand_step(&mut self) -> Result<Step<T>, Status> {
        let end = self.inputs.span(self.segment).1;
        let regime = &mut self.regime;
        let remaining = (-regime.t + end).re();
        let wish = remaining.min(self.settings.max_step);
        let h = regime.expand(1, (wish, self.settings.accuracy(self.marches)));
        if is_lost(h, end) && h < remaining {
            return Err(Status::StepTooSmall { time: regime.time() });
        }
        let event = match self.progress.is_stalled() {
            true => Some((T::of(h.min(NUDGE)), Cause::Stalled, false)),
            false => earliest(regime, h),
        };
        let start = regime.t;
        let length = match event {
            Some((at, ..)) => at,
            None if h >= remaining => -regime.t + end,
            None => T::of(h),
        };
        self.pending = event.map(|(_, cause, _)| cause);
        if let (Some((at, cause, true)), None) = (event, &self.grazing) {
            self.grazing = Some(((start + at).re(), regime.culprit(cause)));
        }
        regime.move_on(1, length);
        regime.t = if event.is_none() && h >= remaining { T::of(end) } else { start + length };
        regime.released.iter_mut().for_each(|r| *r &= length.re() == 0.0);
        self.check_progress(length.re())?;
        Ok(Step { start, length })
    }

    /// Carry out what the last event caused.
    fn change_mode(&mut self) -> Result<(), Status> {
        let Some(mut cause) = self.pending.take() else { return Ok(()) };
        let time = self.regime.t.re();
        if let Some(next) = self.inputs.just_before(self.segment, time) {
            self.regime.t += self.inputs.knot(next) - time;
            self.segment = next;
            cause = cause.at_knot();
        }
        self.take_inputs();
        self.regime.change(cause)
    }

    /// Step into the next segment where the present one is used up; false at the end.
    fn enter_segment(&mut self) -> Result<bool, Status> {
        let (mut entered, mut jumped) = (false, false);
        while self.regime.t.re() >= self.inputs.span(self.segment).1 {
            if self.segment + 1 == self.inputs.segments() {
                return Ok(false);
            }
            // Samples may also have been passed up to the jump.
            let (from, to) = self.inputs.span(self.segment);
            jumped |= from == to;
            self.segment += 1;
            entered = true;
        }
        self.take_inputs();
        // Where a prescribed acceleration jumps, everything that holds against it is decided anew.
        if jumped || (entered && !self.regime.network.prescribed.is_empty()) {
            self.regime.refresh()?;
        } else {
            self.vent()?;
            if entered && self.regime.is_split() {
                self.regime.decide(None)?;
            }
        }
        Ok(true)
    }

    /// Vent what has no load from here on.
    fn vent(&mut self) -> Result<(), Status> {
        loop {
            let inputs = &self.regime.expansion.inputs;
            let gone = self.regime.gone(|input| [inputs[input][0].re(), inputs[input][1].re()]);
            match gone {
                Some((j, _)) => self.regime.change(Cause::Pressed(j))?,
                None => return Ok(()),
            }
        }
    }

    /// Inputs about the present instant.
    pub(super) fn take_inputs(&mut self) {
        let regime = &mut self.regime;
        self.inputs.expand(self.segment, regime.t, &mut regime.expansion.inputs);
        regime.remaining = T::of(self.inputs.span(self.segment).1 - regime.t.re());
    }

    fn check_progress(&mut self, length: f64) -> Result<(), Status> {
        let time = self.regime.t.re();
        if !self.regime.x.iter().all(|v| v.re().is_finite()) {
            return Err(Status::NotFinite { time });
        }
        self.progress.note((time, length), self.pending.is_some()).map_err(|lack| match lack {
            Lack::TooSmall => Status::StepTooSmall { time },
            Lack::Creeping => {
                let element = self.pending.map_or_else(String::new, |c| self.regime.culprit(c));
                Status::Chattering { time, element }
            }
        })
    }

    /// Times of all knots of the inputs, s; they have one more than segments.
    pub fn knots(&self) -> &'a [f64] {
        self.inputs.knots()
    }

    /// Value of an input at a knot.
    #[inline(always)]
    pub fn input_at(&self, i: usize, input: usize) -> T {
        self.inputs.at_knot(i, input)
    }

    /// Whether the inputs end here.
    pub fn is_at_end(&self) -> bool {
        self.regime.t.re() >= self.inputs.knot(self.inputs.segments())
    }
}
