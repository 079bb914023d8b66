// SPDX-License-Identifier: MIT
//! Controller of a shift whose torque phase comes first, with a closed loop of the slip.
//!
//! Preparation and torque phase follow the time from the request. The inertia phase begins where the off-going
//! element slips: a PI controller keeps the slip of the on-coming element on a reference, about a feed-forward
//! pressure. A final ramp locks it.

use super::controller::{Commands, Controller, Measured, RunningController, Slips};
use serde::{Deserialize, Serialize};

/// Slip [rad/s] of the off-going element from which the inertia phase has begun.
const BREAKS_AWAY: f64 = 1.5;
/// Predicted slip [rad/s] of the on-coming element below which the final ramp begins.
const SYNCHRONOUS: f64 = 0.5;
/// Least time [s] from the request to the inertia phase.
const EARLIEST: f64 = 0.03;
/// Duration of the inertia phase, over the planned one, after which the final ramp begins.
const LATEST: f64 = 2.5;
/// Tolerance [s] of times that are multiples of the task.
const ROUND_OFF: f64 = 1e-9;

/// Parameters of the controller. Times count from the request where nothing else is said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShiftController {
    /// Name of the off-going element.
    pub offgoing: String,
    /// Name of the on-coming element.
    pub oncoming: String,
    /// Time between two commands, s.
    pub task: f64,
    /// Request of the gear, s.
    pub request: f64,
    /// Engine torque that the driver demands, N·m.
    pub engine_torque: f64,
    /// Sign of the torque intervention.
    pub direction: f64,
    /// Pressure of a held element, Pa.
    pub system_pressure: f64,
    /// On-coming pressure while the clutch is filled, Pa.
    pub fill_pressure: f64,
    /// End of the filling, s.
    pub fill_time: f64,
    /// On-coming pressure at the begin of the torque phase, Pa.
    pub kiss_pressure: f64,
    /// Duration of the ramp of the torque phase, s.
    pub torque_phase_time: f64,
    /// On-coming pressure at the end of the torque phase, Pa.
    pub handover_pressure: f64,
    /// End of the ramp of the off-going pressure from system pressure, s.
    pub hold_time: f64,
    /// Off-going pressure at its end, Pa.
    pub hold_pressure: f64,
    /// Duration of the ramp of the off-going pressure to zero, s.
    pub release_time: f64,
    /// Feed-forward pressure at the begin of the inertia phase, Pa.
    pub inertia_pressure: f64,
    /// Feed-forward pressure at its end, Pa.
    pub sync_pressure: f64,
    /// Planned duration of the inertia phase, s.
    pub inertia_time: f64,
    /// Share of the reference that is a straight line; the rest has no slope at both ends.
    pub end_slope: f64,
    /// Proportional gain, Pa·s/rad.
    pub gain: f64,
    /// Integral gain, Pa/rad.
    pub integral_gain: f64,
    /// Engine torque intervention, N·m.
    pub reduction_depth: f64,
    /// Begin of the inertia phase to the begin of the intervention, s.
    pub reduction_delay: f64,
    /// Duration of its ramp, s.
    pub reduction_time: f64,
    /// Slip over that at the begin of the inertia phase at which the intervention ends.
    pub return_slip: f64,
    /// Duration of the return of the engine torque, s.
    pub return_time: f64,
    /// Rate of the final ramp, Pa/s.
    pub lock_rate: f64,
    /// Time by which the slip is predicted for the begin of the final ramp, s.
    pub lock_lead: f64,
}

#[derive(Clone, Copy, Debug)]
enum Phase {
    /// Filling and torque phase.
    Preparation,
    Inertia,
    /// Final ramp from a time [s] and a pressure [Pa].
    Locking {
        since: f64,
        from: f64,
    },
}

/// Inertia phase: its begin [s], and the slip [rad/s] of the on-coming element then.
#[derive(Clone, Copy, Debug)]
struct InertiaStart {
    time: f64,
    slip: f64,
}

/// State of the controller.
#[derive(Clone, Debug)]
pub struct ControllerState<'c> {
    given: &'c ShiftController,
    phase: Phase,
    start: InertiaStart,
    /// Slip [rad/s] of the on-coming element at the last task, positive in the inertia phase.
    remaining: f64,
    integral: f64,
    /// Time [s] at which the return of the engine torque began, and the torque then [N·m].
    returns: Option<(f64, f64)>,
    last: Commands,
}

impl Controller for ShiftController {
    fn start(&self) -> Box<dyn RunningController + '_> {
        Box::new(ControllerState::new(self))
    }
}

impl RunningController for ControllerState<'_> {
    fn commands(&self) -> Commands {
        self.last
    }

    fn step(&mut self, time: f64, measured: &Measured) -> Commands {
        self.command(time, measured.slips)
    }
}

impl<'c> ControllerState<'c> {
    /// Controller before the request.
    pub fn new(given: &'c ShiftController) -> Self {
        let last = Commands {
            engine_torque: given.engine_torque,
            offgoing: given.system_pressure,
            oncoming: 0.0,
        };
        let start = InertiaStart { time: 0.0, slip: 0.0 };
        Self {
            given,
            phase: Phase::Preparation,
            start,
            remaining: 0.0,
            integral: 0.0,
            returns: None,
            last,
        }
    }

    /// Commands of the task at a time [s], by the slips then.
    pub fn command(&mut self, time: f64, slips: Slips) -> Commands {
        let elapsed = time - self.given.request + ROUND_OFF;
        self.change_phase(time, elapsed, slips);
        let remaining = self.start.slip.signum() * slips.oncoming;
        self.remaining = remaining;
        let highest = self.given.system_pressure;
        self.last = Commands {
            engine_torque: self.command_torque(time, remaining),
            offgoing: self.command_offgoing(elapsed).clamp(0.0, highest),
            oncoming: self.command_oncoming(time, elapsed, remaining).clamp(0.0, highest),
        };
        self.last
    }

    fn change_phase(&mut self, time: f64, elapsed: f64, slips: Slips) {
        if matches!(self.phase, Phase::Preparation)
            && elapsed > EARLIEST
            && slips.offgoing.abs() > BREAKS_AWAY
        {
            self.start = InertiaStart { time, slip: slips.oncoming };
            self.remaining = slips.oncoming.abs();
            self.phase = Phase::Inertia;
        }
        let remaining = self.start.slip.signum() * slips.oncoming;
        let rate = (remaining - self.remaining) / self.given.task;
        // The loop does not close the slip by itself where it no longer falls after the plan.
        let passed = (time - self.start.time) / self.given.inertia_time;
        let done = remaining + rate.min(0.0) * self.given.lock_lead < SYNCHRONOUS
            || (passed > 1.0 && rate >= 0.0)
            || passed > LATEST;
        if matches!(self.phase, Phase::Inertia) && done {
            self.phase = Phase::Locking { since: time, from: self.last.oncoming };
        }
    }

    fn command_offgoing(&self, elapsed: f64) -> f64 {
        let given = self.given;
        let held = ramp(elapsed, given.hold_time, given.system_pressure, given.hold_pressure);
        let passed = elapsed - given.hold_time;
        if passed < 0.0 { held } else { ramp(passed, given.release_time, given.hold_pressure, 0.0) }
    }

    fn command_oncoming(&mut self, time: f64, elapsed: f64, remaining: f64) -> f64 {
        let given = self.given;
        match self.phase {
            Phase::Preparation if elapsed < 0.0 => 0.0,
            Phase::Preparation if elapsed < given.fill_time => given.fill_pressure,
            Phase::Preparation => {
                let passed = elapsed - given.fill_time;
                ramp(passed, given.torque_phase_time, given.kiss_pressure, given.handover_pressure)
            }
            Phase::Inertia => {
                let passed = time - self.start.time;
                let error = remaining - self.reference(passed);
                self.integral += given.integral_gain * error * given.task;
                let (first, last) = (given.inertia_pressure, given.sync_pressure);
                ramp(passed, given.inertia_time, first, last) + given.gain * error + self.integral
            }
            Phase::Locking { since, from } => from + given.lock_rate * (time - since),
        }
    }

    /// Planned slip [rad/s] of the on-coming element a time [s] after the begin of the inertia phase.
    fn reference(&self, passed: f64) -> f64 {
        let left = ramp(passed, self.given.inertia_time, 1.0, 0.0);
        let smooth = left * left * (3.0 - 2.0 * left);
        let straight = self.given.end_slope;
        self.start.slip.abs() * (straight * left + (1.0 - straight) * smooth)
    }

    fn command_torque(&mut self, time: f64, remaining: f64) -> f64 {
        let given = self.given;
        let ends = match self.phase {
            Phase::Preparation => return given.engine_torque,
            Phase::Inertia => remaining < given.return_slip * self.start.slip.abs(),
            Phase::Locking { .. } => true,
        };
        if ends && self.returns.is_none() {
            self.returns = Some((time, self.last.engine_torque));
        }
        if let Some((since, from)) = self.returns {
            return ramp(time - since, given.return_time, from, given.engine_torque);
        }
        let reduced = given.engine_torque + given.direction * given.reduction_depth;
        let passed = time - self.start.time - given.reduction_delay;
        ramp(passed, given.reduction_time, given.engine_torque, reduced)
    }
}

/// Value a time [s] after the begin of a ramp of a duration [s], constant before and after it.
fn ramp(passed: f64, duration: f64, from: f64, to: f64) -> f64 {
    if passed >= duration {
        to
    } else if passed <= 0.0 {
        from
    } else {
        from + (to - from) * passed / duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller() -> ShiftController {
        ShiftController {
            offgoing: "2".into(),
            oncoming: "3".into(),
            task: 0.01,
            request: 0.1,
            engine_torque: 1000.0,
            direction: -1.0,
            system_pressure: 10.0,
            fill_pressure: 3.0,
            fill_time: 0.05,
            kiss_pressure: 1.0,
            torque_phase_time: 0.1,
            handover_pressure: 5.0,
            hold_time: 0.1,
            hold_pressure: 6.0,
            release_time: 0.1,
            inertia_pressure: 4.0,
            sync_pressure: 5.0,
            inertia_time: 0.4,
            end_slope: 0.0,
            gain: 0.1,
            integral_gain: 0.0,
            reduction_depth: 200.0,
            reduction_delay: 0.0,
            reduction_time: 0.1,
            return_slip: 0.3,
            return_time: 0.2,
            lock_rate: 50.0,
            lock_lead: 0.0,
        }
    }

    fn near(commands: Commands, expected: [f64; 3]) {
        let found = [commands.engine_torque, commands.offgoing, commands.oncoming];
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-6, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn phases_follow_time_and_slip() {
        let given = controller();
        let mut state = ControllerState::new(&given);
        let held = Slips { offgoing: 0.0, oncoming: 60.0 };
        near(state.command(0.09, held), [1000.0, 10.0, 0.0]);
        near(state.command(0.10, held), [1000.0, 10.0, 3.0]);
        near(state.command(0.20, held), [1000.0, 6.0, 3.0]);
        near(state.command(0.25, held), [1000.0, 3.0, 5.0]);
        // The inertia phase begins: on the reference, the feed-forward alone.
        near(state.command(0.30, Slips { offgoing: 2.0, oncoming: 60.0 }), [1000.0, 0.0, 4.0]);
        // In its middle 30 rad/s are planned.
        near(state.command(0.50, Slips { offgoing: 30.0, oncoming: 33.0 }), [800.0, 0.0, 4.8]);
        // Below 18 rad/s the engine torque returns, within 0.2 s.
        state.command(0.60, Slips { offgoing: 45.0, oncoming: 10.0 });
        let locking = state.command(0.70, Slips { offgoing: 60.0, oncoming: 0.0 });
        near(locking, [900.0, 0.0, state.commands().oncoming]);
        let later = state.command(0.74, Slips { offgoing: 60.0, oncoming: 0.0 });
        assert!((later.oncoming - locking.oncoming - 2.0).abs() < 1e-6);
        near(state.command(1.00, Slips { offgoing: 60.0, oncoming: 0.0 }), [1000.0, 0.0, 10.0]);
    }

    #[test]
    fn the_final_ramp_begins_a_lead_ahead_of_the_synchronous_slip() {
        let given = ShiftController { lock_lead: 0.02, ..controller() };
        let mut state = ControllerState::new(&given);
        let at = |slip| Slips { offgoing: 60.0, oncoming: slip };
        state.command(0.30, at(5.0));
        state.command(0.31, at(4.0));
        // 100 rad/s² over 20 ms leave 1 rad/s, over the next task 0.
        state.command(0.32, at(3.0));
        assert!(matches!(state.phase, Phase::Inertia));
        state.command(0.33, at(2.0));
        assert!(matches!(state.phase, Phase::Locking { .. }));
    }

    #[test]
    fn the_final_ramp_begins_where_the_slip_no_longer_falls_after_the_plan() {
        let given = controller();
        let mut state = ControllerState::new(&given);
        let at = |slip| Slips { offgoing: 60.0, oncoming: slip };
        state.command(0.30, at(60.0));
        state.command(0.50, at(60.0));
        assert!(matches!(state.phase, Phase::Inertia));
        state.command(0.71, at(3.0));
        assert!(matches!(state.phase, Phase::Inertia));
        state.command(0.72, at(3.0));
        assert!(matches!(state.phase, Phase::Locking { .. }));
    }

    #[test]
    fn a_downshift_is_mirrored() {
        let given = ShiftController { direction: 1.0, engine_torque: -100.0, ..controller() };
        let mut state = ControllerState::new(&given);
        state.command(0.30, Slips { offgoing: -2.0, oncoming: -60.0 });
        let commands = state.command(0.50, Slips { offgoing: -30.0, oncoming: -33.0 });
        near(commands, [100.0, 0.0, 4.8]);
    }
}
