// SPDX-License-Identifier: MIT
//! Detection of runs without advance: stalls, Zeno behaviour and step underflow.

use crate::solver::tolerances::{
    ADVANCE_RTOL, MIN_ADVANCE_OF_EVENTS, MIN_ADVANCE_OF_STEPS, TIME_RTOL,
};

/// Steps without progress after which a run moves on and decides anew.
const MAX_STALLED: usize = 20;
/// Events over which a run must advance by at least [`MIN_ADVANCE_OF_EVENTS`].
const PROGRESS_WINDOW: usize = 1000;
/// Steps over which a run must advance by at least [`MIN_ADVANCE_OF_STEPS`].
const STEP_WINDOW: usize = 10_000;

/// Work of a run in Taylor steps that the motion itself ends, neither an event nor a sample: some seconds.
const MAX_WORK: f64 = 300_000.0;
/// Further work for every second of the run.
const MAX_WORK_PER_SECOND: f64 = 1000.0;
/// Work of an event in Taylor steps: a search for its instant and a change of mode, about 0.2 ms.
const EVENT_WORK: f64 = 10.0;

/// Counters of the advance of a run over its last steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StallDetector {
    /// Events in a row without progress.
    stalled: usize,
    /// Present window of events.
    events: Window,
    /// Present window of steps.
    steps: Window,
    /// Work so far of events and of steps that the motion ended, in Taylor steps.
    work: f64,
    /// Start of the run, s.
    start: f64,
}

/// Events or steps over which the advance of a run is measured.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Number so far.
    count: usize,
    /// Time at which the window began, s.
    start: f64,
}

impl Window {
    fn from(start: f64) -> Self {
        Self { count: 0, start }
    }
}

/// Kind of a stall.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Stall {
    /// Steps are too small.
    TooSmall,
    /// Events accumulate (Zeno behaviour).
    Zeno,
}

/// Return true if a step of length `h` before the time `end` [s] is lost in round-off.
pub(crate) fn underflows(h: f64, end: f64) -> bool {
    h < TIME_RTOL * (1.0 + end.abs())
}

impl StallDetector {
    /// Create the detector of a run that starts at `time` [s].
    pub fn from(time: f64) -> Self {
        Self {
            stalled: 0,
            events: Window::from(time),
            steps: Window::from(time),
            work: 0.0,
            start: time,
        }
    }

    /// Add the `work` of an event or of a step from `time` [s] on that the motion ended, in Taylor steps.
    /// Return false if the run has too much of it.
    pub fn add_work(&mut self, time: f64, work: f64) -> bool {
        self.work += work;
        self.work < MAX_WORK + (time - self.start) * MAX_WORK_PER_SECOND
    }

    /// Return true if events at one instant do not end.
    pub fn is_stalled(&self) -> bool {
        self.stalled >= MAX_STALLED
    }

    /// Record a step: the time it led to, its length [s], and whether an event ended it.
    pub fn note(&mut self, time: f64, length: f64, event: bool) -> Result<(), Stall> {
        self.steps.count += 1;
        if self.steps.count == STEP_WINDOW {
            if time - self.steps.start < MIN_ADVANCE_OF_STEPS {
                return Err(Stall::TooSmall);
            }
            self.steps = Window::from(time);
        }
        let advances = length > ADVANCE_RTOL * (1.0 + time.abs());
        self.stalled = if advances || !event { 0 } else { self.stalled + 1 };
        if event && !self.add_work(time, EVENT_WORK) {
            return Err(Stall::Zeno);
        }
        self.events.count += usize::from(event);
        if event && self.events.count == PROGRESS_WINDOW {
            if time - self.events.start < MIN_ADVANCE_OF_EVENTS {
                return Err(Stall::Zeno);
            }
            self.events = Window::from(time);
        }
        Ok(())
    }
}
