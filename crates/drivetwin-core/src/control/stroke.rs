// SPDX-License-Identifier: MIT
//! Stroke of the clutch piston against its return spring.

/// Pressure [Pa] above the kiss pressure at which the fill time is stated.
const REFERENCE: f64 = 1e5;

/// Piston whose spring holds the kiss pressure [Pa] while the clutch is not full.
///
/// The stroke takes `fill_time` [s] at 1 bar above the kiss pressure, and changes with the root of the pressure
/// difference in both directions; without fill time the clutch is always full.
#[derive(Clone, Debug)]
pub(super) struct Stroke {
    kiss_pressure: f64,
    fill_time: f64,
    /// Share of the volume that was filled at `since` [s], and the pressure of the valve [Pa] since then.
    filled: f64,
    since: f64,
    valve: f64,
    /// Time [s] at which the clutch is full.
    full_at: f64,
}

impl Stroke {
    /// Stroke at rest with a pressure of the valve [Pa]: full above the kiss pressure, else empty.
    pub fn new(kiss_pressure: f64, fill_time: f64, valve: f64) -> Self {
        let filled = if fill_time <= 0.0 || valve > kiss_pressure { 1.0 } else { 0.0 };
        let since = f64::NEG_INFINITY;
        let full_at = if filled < 1.0 { f64::INFINITY } else { since };
        Self { kiss_pressure, fill_time, filled, since, valve, full_at }
    }

    /// Next time [s] at which the acting pressure changes by itself.
    pub fn next_change(&self) -> f64 {
        if self.filled < 1.0 { self.full_at } else { f64::INFINITY }
    }

    /// Complete the filling; return the acting pressure [Pa].
    pub fn complete(&mut self) -> f64 {
        self.filled = 1.0;
        self.valve
    }

    /// Let the valve have a pressure [Pa] from a time [s] on; return the acting pressure [Pa].
    pub fn set_valve(&mut self, time: f64, valve: f64) -> f64 {
        if self.fill_time <= 0.0 {
            return valve;
        }
        let passed = if self.since.is_finite() { time - self.since } else { 0.0 };
        self.filled = if self.full_at <= time {
            1.0
        } else {
            (self.filled + self.rate() * passed).clamp(0.0, 1.0)
        };
        (self.since, self.valve) = (time, valve);
        let rate = self.rate();
        self.full_at = if rate > 0.0 { time + (1.0 - self.filled) / rate } else { f64::INFINITY };
        if self.full_at <= time {
            self.filled = 1.0;
        }
        self.acting()
    }

    /// Acting pressure [Pa]: at most the kiss pressure until full.
    pub fn acting(&self) -> f64 {
        if self.filled < 1.0 { self.valve.min(self.kiss_pressure) } else { self.valve }
    }

    /// Rate [1/s] of the filled share.
    fn rate(&self) -> f64 {
        let over = (self.valve - self.kiss_pressure) / REFERENCE;
        over.abs().sqrt().copysign(over) / self.fill_time
    }
}
