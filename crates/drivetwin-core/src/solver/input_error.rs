// SPDX-License-Identifier: MIT
//! Errors of input signals.

use thiserror::Error;

/// Reason for which signals cannot serve as inputs.
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
    /// A parameter of a sine is not finite.
    #[error("input {name:?}: offset, amplitude, frequency and phase of a sine must be finite")]
    Sine {
        /// Name of the input.
        name: String,
    },
    /// A prescribed speed jumps.
    #[error("input {name:?} prescribes a speed and must not jump (at {time} s)")]
    Jump {
        /// Name of the input.
        name: String,
        /// Time of the jump, s.
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

/// Refuse values that are no signal.
pub(super) fn check_values(name: &str, times: &[f64], values: &[f64]) -> Result<(), InputError> {
    if times.len() != values.len() || times.len() < 2 {
        let (name, times, values) = (name.to_owned(), times.len(), values.len());
        return Err(InputError::Length { name, times, values });
    }
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(InputError::Value { name: name.to_owned(), index }),
        None => Ok(()),
    }
}

/// Refuse times that do not increase or do not cover the run.
pub(super) fn check_times(
    name: &str,
    times: &[f64],
    start: f64,
    end: f64,
) -> Result<(), InputError> {
    let ordered = |i: usize| {
        times[i].is_finite()
            && (i == 0 || times[i] >= times[i - 1])
            && (i < 2 || times[i] > times[i - 2])
    };
    let name = name.to_owned();
    if let Some(index) = (0..times.len()).find(|&i| !ordered(i)) {
        return Err(InputError::Time { name, index });
    }
    let (from, to) = (times[0], times[times.len() - 1]);
    let slack = 1e-9 * (1.0 + to.abs());
    if start < from - slack || end > to + slack || start.is_nan() || end.is_nan() {
        return Err(InputError::Span { name, from, to, start, end });
    }
    Ok(())
}
