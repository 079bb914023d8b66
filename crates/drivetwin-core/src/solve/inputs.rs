// SPDX-License-Identifier: MIT
//! Inputs over time, linear between samples.

use crate::number::{Real, Series};
use thiserror::Error;

/// How one input varies.
#[derive(Clone, Copy, Debug)]
pub enum Signal<'a, T> {
    /// Linear between samples; a time that stands twice is a jump.
    Samples(&'a [f64], &'a [T]),
    /// `offset + amplitude · sin(2π frequency t + phase)`.
    Sine {
        /// Mean.
        offset: T,
        /// Amplitude.
        amplitude: T,
        /// Frequency, Hz.
        frequency: f64,
        /// Phase at t = 0, rad.
        phase: f64,
    },
}

/// Inputs on a common set of knots; a knot that stands twice is a jump.
#[derive(Clone, Debug)]
pub struct Inputs<T> {
    knots: Vec<f64>,
    /// Values at the knots, knots × inputs; unused for sines.
    values: Vec<T>,
    sines: Vec<Option<Sine<T>>>,
}

/// Offset, amplitude, angular frequency [rad/s], phase [rad].
type Sine<T> = (T, T, f64, f64);

/// Why signals cannot serve as inputs.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InputError {
    /// An input of the network has no signal.
    #[error("input {name:?} has no signal")]
    Missing {
        /// Name of the input.
        name: String,
    },
    /// Lengths differ or there are fewer than two samples.
    #[error("input {name:?}: {times} times and {values} values; both must agree and be at least 2")]
    Length {
        /// Name of the input.
        name: String,
        /// Number of times.
        times: usize,
        /// Number of values.
        values: usize,
    },
    /// Times decrease or are not finite, or a time stands more than twice.
    #[error(
        "input {name:?}: times must be finite and not decrease, at most two equal (sample {index})"
    )]
    Time {
        /// Name of the input.
        name: String,
        /// First offending sample.
        index: usize,
    },
    /// A value is not finite.
    #[error("input {name:?}: value at sample {index} is not finite")]
    Value {
        /// Name of the input.
        name: String,
        /// First offending sample.
        index: usize,
    },
    /// A prescribed speed jumps.
    #[error("input {name:?} prescribes a speed and must not jump (at {time} s)")]
    Jump {
        /// Name of the input.
        name: String,
        /// When.
        time: f64,
    },
    /// The run asks for times outside the signals.
    #[error("input {name:?} spans {from} s to {to} s, the run needs {start} s to {end} s")]
    Span {
        /// Name of the input.
        name: String,
        /// First time of the signal.
        from: f64,
        /// Last time of the signal.
        to: f64,
        /// Start of the run.
        start: f64,
        /// End of the run.
        end: f64,
    },
}

impl<T: Real> Inputs<T> {
    /// Join named signals, in the order the network numbers its inputs, over the span
    /// `(start, end)` [s].
    pub fn join(
        signals: &[(&str, Signal<'_, T>)],
        (start, end): (f64, f64),
    ) -> Result<Self, InputError> {
        let mut knots = vec![start, end];
        let mut sampled: Vec<&[f64]> = Vec::new();
        let mut sines = Vec::new();
        for &(name, signal) in signals {
            match signal {
                Signal::Samples(times, values) => {
                    check(name, times, values, (start, end))?;
                    knots.extend(times.iter().filter(|&&t| t > start && t < end));
                    sampled.push(times);
                    sines.push(None);
                }
                Signal::Sine { offset, amplitude, frequency, phase } => {
                    let omega = 2.0 * std::f64::consts::PI * frequency;
                    sines.push(Some((offset, amplitude, omega, phase)));
                }
            }
        }
        knots.sort_by(f64::total_cmp);
        let knots = merge_knots(&knots, &sampled);
        let mut values = Vec::with_capacity(knots.len() * signals.len());
        for (i, &t) in knots.iter().enumerate() {
            let after_jump = i == 0 || knots[i - 1] == t;
            values.extend(signals.iter().map(|(_, signal)| match signal {
                Signal::Samples(times, samples) => interpolate(times, samples, t, after_jump),
                Signal::Sine { offset, .. } => *offset,
            }));
        }
        Ok(Self { knots, values, sines })
    }

    /// Number of segments between knots.
    pub fn segments(&self) -> usize {
        self.knots.len() - 1
    }

    /// Start and end of segment `i` [s].
    pub fn span(&self, i: usize) -> (f64, f64) {
        (self.knots[i], self.knots[i + 1])
    }

    /// Taylor coefficients of every input at `t` within segment `i`.
    pub fn expand(&self, i: usize, t: T, out: &mut [Series<T>]) {
        let (from, to) = self.span(i);
        let width = to - from;
        let row = |k: usize| &self.values[k * self.sines.len()..(k + 1) * self.sines.len()];
        for (j, series) in out.iter_mut().enumerate() {
            if let Some(sine) = &self.sines[j] {
                *series = sine_series(sine, t);
                continue;
            }
            let (a, b) = (row(i)[j], row(i + 1)[j]);
            let rate = if width > 0.0 { (b - a) / width } else { T::zero_() };
            series[0] = a + rate * (t - from);
            series[1] = rate;
        }
    }
}

/// Taylor coefficients of a sine about `t`.
fn sine_series<T: Real>(&(offset, amplitude, omega, phase): &Sine<T>, t: T) -> Series<T> {
    let angle = t * omega + phase;
    let (sin, cos) = (angle.sin(), angle.cos());
    let mut factor = amplitude;
    std::array::from_fn(|k| {
        if k > 0 {
            factor *= omega / k as f64;
        }
        match k % 4 {
            0 if k == 0 => offset + factor * sin,
            0 => factor * sin,
            1 => factor * cos,
            2 => -factor * sin,
            _ => -factor * cos,
        }
    })
}

fn check<T: Real>(
    name: &str,
    times: &[f64],
    values: &[T],
    (start, end): (f64, f64),
) -> Result<(), InputError> {
    let name = name.to_owned();
    if times.len() != values.len() || times.len() < 2 {
        return Err(InputError::Length { name, times: times.len(), values: values.len() });
    }
    let ordered = |i: usize| {
        times[i].is_finite()
            && (i == 0 || times[i] >= times[i - 1])
            && (i < 2 || times[i] > times[i - 2])
    };
    if let Some(index) = (0..times.len()).find(|&i| !ordered(i)) {
        return Err(InputError::Time { name, index });
    }
    if let Some(index) = values.iter().position(|v| !v.re().is_finite()) {
        return Err(InputError::Value { name, index });
    }
    let (from, to) = (times[0], times[times.len() - 1]);
    let slack = 1e-9 * (1.0 + to.abs());
    if start < from - slack || end > to + slack || start.is_nan() || end.is_nan() {
        return Err(InputError::Span { name, from, to, start, end });
    }
    Ok(())
}

/// Distinct times; times closer than round-off count as one; inner jumps stand twice.
fn merge_knots(sorted: &[f64], sampled: &[&[f64]]) -> Vec<f64> {
    let jump = |t: f64| {
        sampled.iter().any(|times| {
            let i = times.partition_point(|&x| x < t);
            i + 1 < times.len() && times[i] == t && times[i + 1] == t
        })
    };
    let (start, end) = (sorted[0], sorted[sorted.len() - 1]);
    let mut knots: Vec<f64> = Vec::with_capacity(sorted.len());
    for &t in sorted {
        if knots.last().is_none_or(|&last| t - last > 1e-12 * (1.0 + t.abs())) {
            knots.push(t);
            if t > start && t < end && jump(t) {
                knots.push(t);
            }
        }
    }
    knots
}

fn interpolate<T: Real>(times: &[f64], values: &[T], t: f64, after_jump: bool) -> T {
    let last = times.len() - 1;
    let next = if after_jump {
        times.partition_point(|&x| x <= t)
    } else {
        times.partition_point(|&x| x < t)
    };
    if next == 0 {
        return values[0];
    }
    if next > last {
        return values[last];
    }
    let (a, b) = (times[next - 1], times[next]);
    let share = ((t - a) / (b - a)).clamp(0.0, 1.0);
    values[next - 1] + (values[next] - values[next - 1]) * share
}
