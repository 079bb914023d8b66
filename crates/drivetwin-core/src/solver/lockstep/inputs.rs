// SPDX-License-Identifier: MIT
//! Inputs of the lanes of a lockstep batch.

use crate::network::smooth_law::Sample;
use crate::number::{KernelFloat, Number, SimdVector};
use crate::solver::exponential::samples::{InputScratch, InputSource, SharedInputs};
use crate::solver::inputs::{Inputs, SampleRange};
use crate::solver::lockstep::lane::{LANES, Lanes};

/// The inputs of every run.
pub(crate) type PerLaneInputs<'a> = [&'a Inputs<f64>; LANES];

impl InputSource<Lanes> for PerLaneInputs<'_> {
    type Input = Lanes;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut InputScratch<Lanes>) -> &'s Sample<Lanes> {
        for (run, inputs) in self.iter().enumerate() {
            for (to, &[start, rate]) in room.iter_mut().zip(inputs.lines(segment)) {
                (to[0].0[run], to[1].0[run]) = (start, rate);
            }
        }
        &room[..self[0].lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: SampleRange) -> [Lanes; 2] {
        let mut bounds = [Lanes::zero_(); 2];
        for (run, inputs) in self.iter().enumerate() {
            let [low, high] = inputs.bounds(input, samples);
            (bounds[0].0[run], bounds[1].0[run]) = (low, high);
        }
        bounds
    }
}

/// The inputs that all share.
impl InputSource<Lanes> for SharedInputs<'_, f64> {
    type Input = f64;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, _: &'s mut InputScratch<f64>) -> &'s Sample<f64> {
        self.0.lines(segment)
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: SampleRange) -> [Lanes; 2] {
        self.0.bounds(input, samples).map(SimdVector::splat)
    }
}
