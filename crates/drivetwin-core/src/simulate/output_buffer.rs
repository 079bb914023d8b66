// SPDX-License-Identifier: MIT
//! Numbers on a grid by their parts: values, and derivatives by the parameters.

use crate::number::Real;
use crate::solver::BLOCK;
use std::borrow::Borrow;

/// Values of outputs on a grid with their derivatives, filled as a run comes along.
#[derive(Clone, Debug)]
pub(super) struct OutputBuffer<T: Real> {
    /// Points of the grid.
    points: usize,
    /// A column per output, as long as the run has come.
    values: Vec<Vec<f64>>,
    /// A column of derivatives per output, as long as that of its values.
    slopes: Vec<Vec<T::Slopes>>,
}

impl<T: Real> OutputBuffer<T> {
    /// Nothing yet.
    pub fn new(outputs: usize, points: usize) -> Self {
        let column = || Vec::with_capacity(points);
        let values = std::iter::repeat_with(column).take(outputs).collect();
        let column = || Vec::with_capacity(points);
        let slopes = std::iter::repeat_with(column).take(outputs).collect();
        Self { points, values, slopes }
    }

    /// The next value of an output.
    pub fn push(&mut self, output: usize, value: T) {
        self.values[output].push(value.re());
        self.slopes[output].push(value.slopes());
    }

    /// Number of values of an output.
    pub fn length(&self, output: usize) -> usize {
        self.values[output].len()
    }

    /// Add a multiple of the masked samples to an output that ends with those of `block`.
    #[inline(always)]
    pub fn add<const F: bool>(
        &mut self,
        output: usize,
        block: &mut OutputBlock<T>,
        samples: impl Iterator<Item: Borrow<T>>,
        mask: OutputMask,
        factor: T,
    ) {
        let values = &mut self.values[output];
        let count = mask.count();
        let first = block.count == 0;
        block.count = count;
        if first && !T::DERIVATIVES && mask.are_all() {
            // Without clearing the column beforehand.
            let terms = samples.take(count).map(|sample| sample.borrow().re() * factor.re());
            values.extend(terms);
            return;
        }
        values.resize(values.len() + if first { count } else { 0 }, 0.0);
        let at = values.len() - count;
        if first {
            block.sum::<F, true>(&mut values[at..], samples, mask, factor);
        } else {
            block.sum::<F, false>(&mut values[at..], samples, mask, factor);
        }
    }

    /// The derivatives that a block has summed up, out of it.
    #[inline(always)]
    pub fn move_slopes(&mut self, output: usize, block: &mut OutputBlock<T>) {
        let count = std::mem::take(&mut block.count);
        self.slopes[output].extend_from_slice(&block.slopes[..count]);
    }

    /// Fill an output up to a length with zeros.
    pub fn pad_output(&mut self, output: usize, length: usize) {
        self.values[output].resize(length, 0.0);
        self.slopes[output].resize(length, T::zero_().slopes());
    }

    /// Values by output, and derivatives, NaN where the run did not come.
    pub fn finish(mut self) -> (Vec<Vec<f64>>, Vec<Vec<T::Slopes>>) {
        for (values, slopes) in self.values.iter_mut().zip(&mut self.slopes) {
            values.resize(self.points, f64::NAN);
            slopes.resize(self.points, T::NO_SLOPES);
        }
        (self.values, self.slopes)
    }
}

/// The samples of a block that stand on the grid, as bits of [`BLOCK`].
#[derive(Clone, Copy, Debug)]
pub(super) struct OutputMask(u64);

impl OutputMask {
    /// The first `count`.
    pub fn all(count: usize) -> Self {
        Self(if count == BLOCK { u64::MAX } else { (1 << count) - 1 })
    }

    /// Of at most [`BLOCK`] samples at `knots`, those that the rest of the grid begins with.
    pub fn of(grid: &[f64], knots: &[f64]) -> Self {
        if grid.get(..knots.len()) == Some(knots) {
            return Self::all(knots.len());
        }
        let mut lane_mask = 0_u64;
        for (k, knot) in knots.iter().enumerate() {
            lane_mask |= u64::from(grid.get(lane_mask.count_ones() as usize) == Some(knot)) << k;
        }
        Self(lane_mask)
    }

    /// Take the next out: how many samples are left out before it.
    #[inline(always)]
    fn gap(&mut self) -> Option<usize> {
        let gap = self.0.trailing_zeros();
        self.0 = self.0.checked_shr(gap + 1).unwrap_or(0);
        (gap < u64::BITS).then_some(gap as usize)
    }

    /// Their number.
    pub fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Samples up to the last of them.
    pub fn span(self) -> usize {
        (u64::BITS - self.0.leading_zeros()) as usize
    }

    /// True if no sample before the last masked one is left out.
    fn are_all(self) -> bool {
        self.count() == self.span()
    }
}

/// Derivatives of one output over the samples of a block, while its terms are summed up.
#[derive(Clone, Debug)]
pub(super) struct OutputBlock<T: Real> {
    /// Number of samples; none before the first term.
    count: usize,
    slopes: Vec<T::Slopes>,
}

impl<T: Real> OutputBlock<T> {
    /// Without terms.
    pub fn new() -> Self {
        Self { count: 0, slopes: vec![T::zero_().slopes(); BLOCK] }
    }

    /// Add a multiple of the masked samples to the derivatives and to `values`; `FIRST` where there is
    /// nothing yet.
    #[inline(always)]
    fn sum<const F: bool, const FIRST: bool>(
        &mut self,
        values: &mut [f64],
        mut samples: impl Iterator<Item: Borrow<T>>,
        mut mask: OutputMask,
        factor: T,
    ) {
        if !FIRST && !T::DERIVATIVES && mask.are_all() {
            for (value, sample) in values.iter_mut().zip(samples) {
                *value += sample.borrow().re() * factor.re();
            }
            return;
        }
        let mut at = 0;
        // The number of samples is not fixed beforehand, so the compiler does not combine several samples
        // by gathering data that are a vector already.
        while let Some(sample) = mask.gap().and_then(|gap| samples.nth(gap)) {
            let (sample, slopes) = (sample.borrow(), &mut self.slopes[at]);
            let (value, sum) = (&mut values[at], T::from_slopes(*slopes));
            *value = sample.re() * factor.re() + if FIRST { 0.0 } else { *value };
            *slopes = sample.fma::<F>(factor, if FIRST { T::zero_() } else { sum }).slopes();
            at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::{Dual, Number};

    #[test]
    fn values_and_derivatives_stand_apart_and_what_was_not_reached_is_no_number() {
        let numbers = [Dual::new(5.0, [50.0, 0.0]), Dual::new(7.0, [70.0, 1.0])];
        let (ones, mask) = ([Dual::of(1.0); 2], OutputMask::all(2));
        let mut buffer = OutputBuffer::new(2, 3);
        buffer.push(0, numbers[0]);
        buffer.push(0, numbers[1]);
        let mut block = OutputBlock::new();
        buffer.add::<false>(1, &mut block, numbers.iter(), mask, Dual::of(-2.0));
        buffer.add::<false>(1, &mut block, ones.iter(), mask, Dual::new(0.0, [0.0, 10.0]));
        buffer.move_slopes(1, &mut block);
        let (values, slopes) = buffer.finish();
        assert_eq!((&values[0][..2], &values[1][..2]), (&[5.0, 7.0][..], &[-10.0, -14.0][..]));
        assert!(values[0][2].is_nan() && slopes.iter().flat_map(|s| s[2]).all(f64::is_nan));
        assert_eq!(slopes[0][..2], [[50.0, 0.0], [70.0, 1.0]]);
        assert_eq!(slopes[1][..2], [[-100.0, 10.0], [-140.0, 8.0]]);
    }

    #[test]
    fn only_the_samples_on_the_grid_are_recorded() {
        let numbers = [1.0, 2.0, 3.0, 4.0].map(|re| Dual::new(re, [10.0 * re]));
        let mask = OutputMask::of(&[0.1, 0.3, 0.9], &[0.0, 0.1, 0.2, 0.3]);
        let (mut buffer, mut block) = (OutputBuffer::new(1, 2), OutputBlock::new());
        buffer.add::<false>(0, &mut block, numbers.iter(), mask, Dual::of(1.0));
        buffer.move_slopes(0, &mut block);
        assert_eq!(buffer.finish(), (vec![vec![2.0, 4.0]], vec![vec![[20.0], [40.0]]]));
    }
}
