// SPDX-License-Identifier: MIT
//! Sensors of speeds between a driveline and its controller: sampling, delay, noise, rounding.

use super::controller::{Measured, Slips};
use serde::{Deserialize, Serialize};

/// Share of a sampling period by which times that are multiples of it may be off.
const ROUND_OFF: f64 = 1e-9;

/// Sensor of a speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeedSensor {
    /// Standard deviation of a sample, rad/s.
    pub noise: f64,
    /// Rounding step, rad/s; 0 for none.
    pub quantum: f64,
    /// Time between two samples, s; 0 for a sample at each task.
    pub period: f64,
    /// Age of a sample at its arrival, s.
    pub delay: f64,
}

/// Sensors of a made unit. A controller computes both slips from their speeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Of the engine and of the gearbox input.
    pub engine: SpeedSensor,
    /// Of the gearbox output.
    pub output: SpeedSensor,
    /// Slip of the off-going and the on-coming element over the speeds of gearbox input and output.
    pub slips: [[f64; 2]; 2],
    /// Seed of noise and phases.
    pub seed: u64,
}

/// Sensors in motion: the true speeds of engine, gearbox input and output [rad/s] at the tasks so far [s].
pub(super) struct Sensing {
    given: Sensors,
    history: Vec<(f64, [f64; 3])>,
}

impl Sensing {
    /// Sensors before the first task.
    pub fn new(given: Sensors) -> Self {
        Self { given, history: Vec::new() }
    }

    /// Quantities as the controller has them at a task at a time [s].
    pub fn sense(&mut self, time: f64, exact: &Measured) -> Measured {
        let Sensors { engine, output, slips: [off, on], .. } = self.given;
        let input = (exact.slips.oncoming - on[1] * exact.output_speed) / on[0];
        self.history.push((time, [exact.engine_speed, input, exact.output_speed]));
        let [engine_speed, input] = [0, 1].map(|place| self.read(&engine, place, 0));
        let output_speed = self.read(&output, 2, 1);
        let slip = |of: [f64; 2]| of[0] * input + of[1] * output_speed;
        Measured {
            slips: Slips { offgoing: slip(off), oncoming: slip(on) },
            engine_speed,
            output_speed,
        }
    }

    /// Last sample of a speed that has arrived; sensors of one `stream` have the same noise.
    fn read(&self, sensor: &SpeedSensor, place: usize, stream: u64) -> f64 {
        let seed = mix(self.given.seed ^ mix(stream));
        let due = self.history.last().map_or(0.0, |one| one.0) - sensor.delay;
        let phase = uniform(seed);
        let (number, instant) = if sensor.period > 0.0 {
            let number = (due / sensor.period - phase + ROUND_OFF).floor();
            (number, (number + phase) * sensor.period)
        } else {
            (self.history.len() as f64, due)
        };
        let noisy =
            self.interpolate(place, instant) + sensor.noise * normal(seed ^ number.to_bits());
        if sensor.quantum > 0.0 { (noisy / sensor.quantum).round() * sensor.quantum } else { noisy }
    }

    /// Speed at an instant [s], linear between the tasks and constant before the first.
    fn interpolate(&self, place: usize, instant: f64) -> f64 {
        let after = self.history.iter().rposition(|one| one.0 <= instant).map_or(0, |at| at + 1);
        let [before, next] = [after.saturating_sub(1), after.min(self.history.len() - 1)];
        let ((begin, from), (end, to)) = (self.history[before], self.history[next]);
        let share = if end > begin { (instant - begin) / (end - begin) } else { 0.0 };
        from[place] + share * (to[place] - from[place])
    }
}

/// Pseudorandom bits. Source: G. Steele, D. Lea and C. Flood, Fast splittable pseudorandom number generators,
/// OOPSLA (2014).
fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Number above 0 and up to 1.
fn uniform(seed: u64) -> f64 {
    ((mix(seed) >> 11) as f64 + 1.0) / (1_u64 << 53) as f64
}

/// Normal number, by the transform of G. Box and M. Muller.
fn normal(seed: u64) -> f64 {
    let (radius, angle) = (uniform(seed), uniform(!seed));
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}
