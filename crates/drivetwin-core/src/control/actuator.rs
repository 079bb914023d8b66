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

/// Actuator in motion.
#[derive(Clone, Debug)]
pub struct Actuator {
    half_hysteresis: f64,
    dead_time: f64,
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
            half_hysteresis: 0.5 * model.hysteresis,
            dead_time: model.dead_time,
            valve: command,
            pending: VecDeque::new(),
            lag: Lag::new(rising_lag, falling_lag, damping, stroke.acting(), step),
            stroke,
            time,
        }
    }

    /// Command a pressure [Pa] from the present time on; zero or less shuts the valve.
    pub fn command(&mut self, wanted: f64) {
        let half = self.half_hysteresis;
        let moved = self.valve.max(wanted - half).max(0.0).min(wanted + half);
        let valve = if wanted > 0.0 { moved } else { 0.0 };
        if valve != self.valve {
            self.valve = valve;
            self.pending.push_back((self.time + self.dead_time, valve));
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
