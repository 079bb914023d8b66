// SPDX-License-Identifier: MIT
//! Inputs, channel states and output buffers of fixed-step runs.

use crate::network::smooth_law::{LawValue, MAX_INPUTS, Sample};
use crate::number::{Coefficient, FOUR, KernelFloat, Real};
use crate::solver::exponential::propagator::{ChannelCoefficients, Form, Propagator};
use crate::solver::inputs::{Inputs, SampleRange};

/// Samples that are passed before they are handed on.
pub const BLOCK: usize = 64;

/// Inputs of one run or several.
pub trait InputSource<L: KernelFloat> {
    /// Plain numbers, or where runs have inputs of their own or a delay is a parameter, numbers like the
    /// state. With derivatives these jump between segments.
    type Input: Coefficient<L, Values: Coefficient<L::Values>>;

    /// The inputs of a segment, in `room` where they stand nowhere.
    fn read<'s>(
        &'s self,
        segment: usize,
        room: &'s mut InputScratch<Self::Input>,
    ) -> &'s Sample<Self::Input>;

    /// The least and the largest value of an input over a range of samples, or bounds of these.
    fn bounds(&self, input: usize, samples: SampleRange) -> [L::Values; 2];
}

/// Room for the inputs of a segment.
pub type InputScratch<U> = [[U; 2]; MAX_INPUTS];

/// [`InputScratch`] without inputs.
#[inline(always)]
pub fn room<U: KernelFloat>() -> InputScratch<U> {
    [[U::splat(0.0); 2]; MAX_INPUTS]
}

/// Evaluate a line (value, rate) after `h` [s], without derivatives.
#[inline(always)]
pub(crate) fn line_end<U: KernelFloat>([start, rate]: [U; 2], h: f64) -> U::Values {
    rate.values().times(h) + start.values()
}

/// The inputs of one run.
pub(crate) struct SharedInputs<'a, T>(pub &'a Inputs<T>);

impl<T: Real> InputSource<T> for SharedInputs<'_, T> {
    type Input = f64;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, _: &'s mut InputScratch<f64>) -> &'s Sample<f64> {
        self.0.lines(segment)
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: SampleRange) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}

/// The inputs of one run where a delay is a parameter.
pub(crate) struct DelayedInputs<'a, T>(pub &'a Inputs<T>);

impl<T: Real> InputSource<T> for DelayedInputs<'_, T> {
    type Input = T;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut InputScratch<T>) -> &'s Sample<T> {
        for (to, line) in room.iter_mut().zip(self.0.lines_at(segment)) {
            *to = line;
        }
        &room[..self.0.lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: SampleRange) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}

/// A carried channel at the start of a sample.
#[derive(Clone, Copy, Debug)]
pub struct ChannelState<L> {
    /// Argument.
    pub argument: L,
    /// Its rate over a sample.
    pub rate: L,
    /// Torque with its slopes.
    pub value: LawValue<L>,
    /// Argument expected at the end of the sample.
    pub predicted_argument: L,
    /// Stiction there.
    pub stiction: L,
}

impl<L: KernelFloat> ChannelState<L> {
    /// State of an inactive channel.
    pub fn idle() -> Self {
        let none = L::splat(0.0);
        Self {
            argument: none,
            rate: none,
            value: LawValue::zero(),
            predicted_argument: none,
            stiction: none,
        }
    }

    /// Replace the values of the lanes in a mask by those of `other`.
    #[inline(always)]
    pub fn replace_where(&self, runs: u32, other: &Self) -> Self {
        let (own, value) = (&self.value, &other.value);
        Self {
            argument: self.argument.replace_where(runs, other.argument),
            rate: self.rate.replace_where(runs, other.rate),
            value: LawValue {
                value: own.value.replace_where(runs, value.value),
                by_argument: own.by_argument.replace_where(runs, value.by_argument),
                half_second_derivative: own
                    .half_second_derivative
                    .replace_where(runs, value.half_second_derivative),
                by_normal: own.by_normal.replace_where(runs, value.by_normal),
                mixed: own.mixed.replace_where(runs, value.mixed),
            },
            predicted_argument: self
                .predicted_argument
                .replace_where(runs, other.predicted_argument),
            stiction: self.stiction.replace_where(runs, other.stiction),
        }
    }

    /// All channels at the start of a segment.
    #[inline(always)]
    pub fn start<const F: bool, const N: usize, const A: usize, U: Coefficient<L>>(
        op: &Propagator<L, N>,
        sample: &Sample<U>,
        x: &[L; N],
    ) -> [Self; A] {
        let channels: &[_; A] = op.channels.first_chunk().expect("as many as are carried");
        let mut out = [Self::idle(); A];
        for a in 0..A {
            let ChannelCoefficients { argument, law, .. } = &channels[a];
            for i in 0..op.columns() {
                out[a].argument = argument[i].fma::<F>(x[i], out[a].argument);
            }
            let m = out[a].argument;
            let normal = law.normal.start::<F, U>(sample);
            out[a].value = law.expand_at::<F>(m, law.stiction::<F>(m)).value_at_center(normal);
        }
        for a in 0..A {
            let form = &channels[a].rate;
            let mut rate = add_channels::<L, F, N, A>(form, &out, form.constant);
            for i in 0..op.columns() {
                rate = form.state[i].fma::<F>(x[i], rate);
            }
            for drive in &op.inputs {
                rate = sample[drive.input][0].multiply_add::<F>(drive.now[a], rate);
            }
            out[a].rate = rate;
            out[a].predicted_argument = rate + out[a].argument;
            out[a].stiction = channels[a].law.stiction::<F>(out[a].predicted_argument);
        }
        out
    }
}

impl<L: KernelFloat, const N: usize> ChannelCoefficients<L, N> {
    /// Its torque φ.
    #[inline(always)]
    pub fn torque(&self, carry: &ChannelState<L>) -> L {
        self.law.sign * carry.value.value
    }
}

/// Add the contributions of the carried channels to `sum`.
#[inline(always)]
pub fn add_channels<L: KernelFloat, const F: bool, const N: usize, const A: usize>(
    form: &Form<L, N>,
    carry: &[ChannelState<L>; A],
    sum: L,
) -> L {
    let mut sum = sum;
    for a in 0..A {
        sum = form.channels[a].fma::<F>(carry[a].value.value, sum);
    }
    sum
}

/// One value at every sample, in whole fours.
pub type SampleColumn<L> = [L; BLOCK + FOUR];

/// States and torques of the carried channels at the start of passed samples, and at the end of the last,
/// each as a column over the samples: first the states.
pub struct SampleBuffer<L, const N: usize>(Vec<SampleColumn<L>>);

impl<L: KernelFloat, const N: usize> SampleBuffer<L, N> {
    /// Create a buffer for a number of channels from columns of an earlier one.
    pub fn in_columns(mut columns: Vec<SampleColumn<L>>, channels: usize) -> Self {
        if columns.len() < N + channels {
            columns.resize(N + channels, [L::splat(0.0); BLOCK + FOUR]);
        }
        Self(columns)
    }

    /// Return the stored samples.
    pub fn samples(&self) -> Samples<'_, L> {
        let (states, torques) = self.0.split_at(N);
        Samples { states, torques }
    }

    /// The columns, for another trail.
    pub fn into_columns(self) -> Vec<SampleColumn<L>> {
        self.0
    }

    /// Set sample `k`.
    #[inline(always)]
    pub fn store<const A: usize>(
        &mut self,
        op: &Propagator<L, N>,
        k: usize,
        x: &[L; N],
        carry: &[ChannelState<L>; A],
    ) {
        let (states, torques) = self.0.split_first_chunk_mut::<N>().expect("a column by state");
        for i in 0..op.columns() {
            states[i][k] = x[i];
        }
        for a in 0..A {
            torques[a][k] = op.channels[a].torque(&carry[a]);
        }
    }

    /// State `i`.
    #[inline(always)]
    pub fn states(&self, i: usize) -> &SampleColumn<L> {
        &self.0[i]
    }

    /// Torque of the carried channel number `slot`.
    #[inline(always)]
    pub fn torques(&self, slot: usize) -> &SampleColumn<L> {
        &self.0[N + slot]
    }
}

/// States and torques of the active channels at the start of samples, at least of those passed.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'s, L> {
    /// States, one column each.
    pub states: &'s [SampleColumn<L>],
    /// Torques, one column per active channel.
    pub torques: &'s [SampleColumn<L>],
}
