// SPDX-License-Identifier: MIT
//! An input over time as the caller states it.

use crate::number::Real;

/// Time history of one input.
#[derive(Clone, Copy, Debug)]
pub enum Signal<'a, T> {
    /// Linear between samples; a time that stands twice is a jump.
    Samples {
        /// Times, s.
        times: &'a [f64],
        /// Values, SI.
        values: &'a [f64],
        /// The input at time t is the sample of time t - delay, s. Derivatives with respect to it are
        /// exact for signals without jumps.
        delay: T,
    },
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

impl<'a, T: Real> Signal<'a, T> {
    /// Samples without delay.
    pub fn samples(times: &'a [f64], values: &'a [f64]) -> Self {
        Self::Samples { times, values, delay: T::zero_() }
    }

    /// Delay of samples, s.
    pub fn delay_mut(&mut self) -> Option<&mut T> {
        match self {
            Self::Samples { delay, .. } => Some(delay),
            Self::Sine { .. } => None,
        }
    }
}

impl<'a> Signal<'a, f64> {
    /// Convert the signal to another number type.
    pub fn promote<T: Real>(&self) -> Signal<'a, T> {
        match *self {
            Self::Samples { times, values, delay } => {
                Signal::Samples { times, values, delay: T::of(delay) }
            }
            Self::Sine { offset, amplitude, frequency, phase } => {
                let (offset, amplitude) = (T::of(offset), T::of(amplitude));
                Signal::Sine { offset, amplitude, frequency, phase }
            }
        }
    }
}
