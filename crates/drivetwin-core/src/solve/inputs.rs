// SPDX-License-Identifier: MIT
//! Inputs over time, linear between samples.

use crate::number::Real;
use thiserror::Error;

/// Inputs on a common set of knots; a time that stands twice is a jump.
#[derive(Clone, Debug)]
pub struct Inputs<T> {
    knots: Vec<f64>,
    values: Vec<T>,
    count: usize,
}

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
    /// Join signals `(name, times, values)`, in the order the network numbers its inputs, over the
    /// span `(start, end)` [s].
    pub fn join(
        signals: &[(&str, &[f64], &[T])],
        (start, end): (f64, f64),
    ) -> Result<Self, InputError> {
        let mut knots = vec![start, end];
        for &(name, times, values) in signals {
            check(name, times, values, (start, end))?;
            knots.extend(times.iter().filter(|&&t| t > start && t < end));
        }
        knots.sort_by(f64::total_cmp);
        let knots = merge_knots(&knots, signals);
        let count = signals.len();
        let mut values = Vec::with_capacity(knots.len() * count);
        for (i, &t) in knots.iter().enumerate() {
            let after_jump = i > 0 && knots[i - 1] == t;
            for &(_, times, samples) in signals {
                values.push(interpolate(times, samples, t, after_jump || i == 0));
            }
        }
        Ok(Self { knots, values, count })
    }

    /// Number of segments between knots.
    pub fn segments(&self) -> usize {
        self.knots.len() - 1
    }

    /// Start and end of segment `i` [s].
    pub fn span(&self, i: usize) -> (f64, f64) {
        (self.knots[i], self.knots[i + 1])
    }

    /// Value and rate of every input at `t` within segment `i`.
    pub fn at(&self, i: usize, t: T, out: &mut Vec<[T; 2]>) {
        let (from, to) = self.span(i);
        let width = to - from;
        let row = |k: usize| &self.values[k * self.count..(k + 1) * self.count];
        out.clear();
        out.extend(row(i).iter().zip(row(i + 1)).map(|(&a, &b)| {
            let rate = if width > 0.0 { (b - a) / width } else { T::zero_() };
            [a + rate * (t - from), rate]
        }));
    }
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
fn merge_knots<T>(sorted: &[f64], signals: &[(&str, &[f64], &[T])]) -> Vec<f64> {
    let jump = |t: f64| {
        signals.iter().any(|(_, times, _)| {
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
