// SPDX-License-Identifier: MIT
//! Whether a run gets ahead.

/// Steps without progress after which a run moves on and decides anew.
const MAX_STALLED: usize = 20;
/// Events over which a run must advance by at least [`MIN_PROGRESS`].
const PROGRESS_WINDOW: usize = 1000;
/// Least advance over a window of events, s; below lies Zeno behaviour.
const MIN_PROGRESS: f64 = 1e-7;
/// Steps over which a run must advance by at least [`MIN_ADVANCE`].
const STEP_WINDOW: usize = 10_000;
/// Least advance over a window of steps, s; below, the motion is too stiff or has blown up.
const MIN_ADVANCE: f64 = 1e-3;

/// The advance of a run over its last steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Progress {
    /// Events in a row without progress.
    stalled: usize,
    /// Events since, and time of, the last look at these.
    events: (usize, f64),
    /// Steps since, and time of, the last look at these.
    steps: (usize, f64),
}

/// How a run fails to get ahead.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lack {
    /// Its steps are too small.
    TooSmall,
    /// Its events follow each other too closely.
    Creeping,
}

/// Whether a step of length `h` before the time `end` [s] is lost in round-off.
pub(super) fn is_lost(h: f64, end: f64) -> bool {
    h < 1e-14 * (1.0 + end.abs())
}

impl Progress {
    /// Of a run that starts at `time` [s].
    pub fn from(time: f64) -> Self {
        Self { stalled: 0, events: (0, time), steps: (0, time) }
    }

    /// Whether events at one instant do not come to an end.
    pub fn is_stalled(&self) -> bool {
        self.stalled >= MAX_STALLED
    }

    /// Take note of a step, the time it led to and its length [s], and whether an event ended it.
    pub fn note(&mut self, (time, length): (f64, f64), event: bool) -> Result<(), Lack> {
        self.steps.0 += 1;
        if self.steps.0 == STEP_WINDOW {
            if time - self.steps.1 < MIN_ADVANCE {
                return Err(Lack::TooSmall);
            }
            self.steps = (0, time);
        }
        let advances = length > 1e-13 * (1.0 + time.abs());
        self.stalled = if advances || !event { 0 } else { self.stalled + 1 };
        self.events.0 += usize::from(event);
        if event && self.events.0 == PROGRESS_WINDOW {
            if time - self.events.1 < MIN_PROGRESS {
                return Err(Lack::Creeping);
            }
            self.events = (0, time);
        }
        Ok(())
    }
}
