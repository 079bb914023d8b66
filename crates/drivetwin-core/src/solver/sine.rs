// SPDX-License-Identifier: MIT
//! Sine inputs.

use crate::number::{Real, Series};

/// A sine as operators take it, by its value and its rate at the start of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Angular frequency, rad/s.
    pub omega: f64,
    /// Mean.
    pub offset: f64,
    /// Amplitude.
    pub amplitude: f64,
}

/// Offset, amplitude, angular frequency [rad/s], phase [rad].
pub type Sine<T> = (T, T, f64, f64);

/// A sine without derivatives.
pub fn wave<T: Real>(&(offset, amplitude, omega, _): &Sine<T>) -> Wave {
    Wave { omega, offset: offset.re(), amplitude: amplitude.re() }
}

/// Values and rates of a sine at the start of all segments.
pub fn fill_sine<'l, T: Real>(
    lines: impl Iterator<Item = &'l mut [f64; 2]>,
    knots: &[f64],
    sine: &Sine<T>,
) {
    for (line, &t) in lines.zip(knots) {
        let series = sine_series(sine, T::of(t));
        *line = [series[0].re(), series[1].re()];
    }
}

/// Taylor coefficients of a sine about `t`.
pub fn sine_series<T: Real>(&(offset, amplitude, omega, phase): &Sine<T>, t: T) -> Series<T> {
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
