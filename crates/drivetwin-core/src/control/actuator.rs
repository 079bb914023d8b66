// SPDX-License-Identifier: MIT
//! Hydraulic actuator of a clutch: hysteresis, dead time, fill of the clutch, second-order lag.

use super::lag::Lag;
use super::stroke::Stroke;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Parameters of an actuator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorModel {
    /// Command to the first movement of the pressure, s.
    pub dead_time: f64,
    /// Time constant while the pressure rises, s.
    pub rising_lag: f64,
    /// Time constant while the pressure falls, s.
    pub falling_lag: f64,
    /// Damping ratio of the lag.
    pub damping: f64,
    /// Pressure while the clutch is filled, Pa.
    pub kiss_pressure: f64,
    /// Time of the filling at 1 bar above the kiss pressure, s.
    pub fill_time: f64,
    /// Pressure of a falling command over that of a rising one, Pa.
    pub hysteresis: f64,
}

impl ActuatorModel {
    /// Pressures [Pa] at increasing times `at` [s] by `commands`, times [s] with pressures [Pa] held from there on.
    ///
    /// At rest before the first command: at `initial` [Pa] as far as the hysteresis allows it, or without it at
    /// that command. Nothing without a command.
    pub fn respond(&self, commands: &[(f64, f64)], initial: Option<f64>, at: &[f64]) -> Vec<f64> {
        let (Some(&(begin, first)), Some(&start)) = (commands.first(), at.first()) else {
            return Vec::new();
        };
        let valve = self.move_valve(initial.unwrap_or(first), first);
        let step = at.get(1).map_or(0.0, |next| next - start);
        let mut actuator = Actuator::new(self, valve, start.min(begin), step);
        let mut left = commands.iter().peekable();
        at.iter()
            .map(|&time| {
                while let Some(&(change, wanted)) = left.next_if(|one| one.0 <= time) {
                    actuator.advance(change);
                    actuator.command(wanted);
                }
                actuator.advance(time)
            })
            .collect()
    }

    /// Pressure [Pa] of a valve at `valve` [Pa] after a command [Pa]: a play centred on it, shut at zero or less.
    fn move_valve(&self, valve: f64, wanted: f64) -> f64 {
        let half = 0.5 * self.hysteresis;
        if wanted > 0.0 { valve.max(wanted - half).max(0.0).min(wanted + half) } else { 0.0 }
    }
}

/// Actuator in motion.
#[derive(Clone, Debug)]
pub struct Actuator {
    model: ActuatorModel,
    valve: f64,
    /// Pressures of the valve [Pa] with the times [s] at which they reach the clutch.
    pending: VecDeque<(f64, f64)>,
    stroke: Stroke,
    lag: Lag,
    time: f64,
}

impl Actuator {
    /// Actuator at rest on a command [Pa] at a time [s]; `step` [s] is the usual time between two pressures.
    pub fn new(model: &ActuatorModel, command: f64, time: f64, step: f64) -> Self {
        let stroke = Stroke::new(model.kiss_pressure, model.fill_time, command);
        let &ActuatorModel { rising_lag, falling_lag, damping, .. } = model;
        Self {
            model: *model,
            valve: command,
            pending: VecDeque::new(),
            lag: Lag::new(rising_lag, falling_lag, damping, stroke.acting(), step),
            stroke,
            time,
        }
    }

    /// Command a pressure [Pa] from the present time on; zero or less shuts the valve.
    pub fn command(&mut self, wanted: f64) {
        let valve = self.model.move_valve(self.valve, wanted);
        if valve != self.valve {
            self.valve = valve;
            self.pending.push_back((self.time + self.model.dead_time, valve));
        }
    }

    /// Pressure [Pa] at the present time.
    pub fn pressure(&self) -> f64 {
        self.lag.pressure()
    }

    /// Move on to a later time [s]; return the pressure [Pa] there.
    pub fn advance(&mut self, to: f64) -> f64 {
        loop {
            let arrival = self.pending.front().map_or(f64::INFINITY, |&(time, _)| time);
            let next = arrival.min(self.stroke.next_change());
            if next > to {
                break;
            }
            self.pass(next);
            let acting = if arrival <= next {
                let valve = self.pending.pop_front().map_or(self.valve, |(_, valve)| valve);
                self.stroke.set_valve(arrival, valve)
            } else {
                self.stroke.complete()
            };
            self.lag.set_input(acting);
        }
        self.pass(to);
        self.lag.pressure()
    }

    fn pass(&mut self, to: f64) {
        self.lag.pass(to - self.time);
        self.time = to.max(self.time);
    }
}
