// SPDX-License-Identifier: MIT
//! Numbers on a grid by their parts: values, and derivatives by the parameters.

use crate::number::Real;
use crate::solve::BLOCK;
use std::borrow::Borrow;

/// Values of outputs on a grid with their derivatives, filled as a run comes along.
#[derive(Clone, Debug)]
pub(super) struct Recorded<T: Real> {
    /// Points of the grid.
    points: usize,
    /// A column per output, as long as the run has come.
    values: Vec<Vec<f64>>,
    /// The same of derivatives.
    slopes: Vec<Vec<T::Slopes>>,
}

impl<T: Real> Recorded<T> {
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

    /// Add a multiple of a quantity to the values of an output from `from` on, where there are none to
    /// nothing.
    #[inline(always)]
    pub fn add(&mut self, (output, from): (usize, usize), source: &Values, factor: f64) {
        let (values, sums) = (source.values(), &mut self.values[output]);
        if sums.len() > from {
            add(&mut sums[from..], values, factor);
        } else {
            sums.extend(values.iter().map(|value| factor * value));
        }
    }

    /// Add the derivatives of the same.
    #[inline(always)]
    pub fn add_slopes<const F: bool>(
        &mut self,
        (output, from): (usize, usize),
        (mut samples, mut picked): (impl Iterator<Item: Borrow<T>>, Picked),
        factor: T,
    ) {
        let (sums, mut at) = (&mut self.slopes[output], from);
        // Its length not known beforehand, the compiler does not take several samples at once, and
        // gather what is a vector already.
        while let Some(number) = picked.gap().and_then(|gap| samples.nth(gap)) {
            let number = *number.borrow();
            match sums.get_mut(at) {
                Some(sum) => *sum = number.fma::<F>(factor, T::sloped(*sum)).slopes(),
                None => sums.push(number.fma::<F>(factor, T::zero_()).slopes()),
            }
            at += 1;
        }
    }

    /// Add the derivatives of the same where the quantity has none.
    #[inline(always)]
    pub fn add_slopes_of_factor<const F: bool>(
        &mut self,
        to: (usize, usize),
        source: &Values,
        factor: T,
    ) {
        if !factor.is_constant() {
            let plain = source.values().iter().map(|&value| T::of(value));
            self.add_slopes::<F>(to, (plain, Picked::all(source.count)), factor);
        }
    }

    /// Fill an output up to a length with zeros.
    pub fn fill(&mut self, output: usize, length: usize) {
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

#[inline(always)]
fn add(to: &mut [f64], values: &[f64], factor: f64) {
    for (to, value) in to.iter_mut().zip(values) {
        *to += factor * value;
    }
}

/// The samples of a block that stand on the grid, as bits of [`BLOCK`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Picked(u64);

impl Picked {
    /// The first `count`.
    pub fn all(count: usize) -> Self {
        Self(if count == BLOCK { u64::MAX } else { (1 << count) - 1 })
    }

    /// Of at most [`BLOCK`] samples at `knots`, those that the rest of the grid begins with.
    pub fn of(grid: &[f64], knots: &[f64]) -> Self {
        if grid.get(..knots.len()) == Some(knots) {
            return Self::all(knots.len());
        }
        let mut bits = 0_u64;
        for (k, knot) in knots.iter().enumerate() {
            bits |= u64::from(grid.get(bits.count_ones() as usize) == Some(knot)) << k;
        }
        Self(bits)
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

    /// Whether none before the last is left out.
    fn are_all(self) -> bool {
        self.count() == self.span()
    }

    fn contains(self, k: usize) -> bool {
        self.0 >> k & 1 == 1
    }
}

/// Values of one quantity over the samples of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct Values {
    /// Whether it has been taken up.
    pub known: bool,
    /// Number of samples.
    count: usize,
    /// Room for [`BLOCK`] of them.
    values: Vec<f64>,
}

impl Values {
    /// Take up the picked samples.
    #[inline(always)]
    pub fn set<T: Real>(&mut self, samples: impl Iterator<Item: Borrow<T>>, picked: Picked) {
        self.values.resize(BLOCK, 0.0);
        (self.known, self.count) = (true, picked.count());
        if !T::DERIVATIVES && picked.are_all() {
            for (to, number) in self.values[..self.count].iter_mut().zip(samples) {
                *to = number.borrow().re();
            }
        } else {
            self.set_each(samples, picked);
        }
    }

    /// The same, one by one. Not inlined, so that it is not compiled for the widest instructions: these
    /// would gather from strides, which takes longer.
    #[inline(never)]
    fn set_each<T: Real>(&mut self, samples: impl Iterator<Item: Borrow<T>>, picked: Picked) {
        let samples = samples.take(picked.span()).enumerate();
        let samples = samples.filter(|(k, _)| picked.contains(*k));
        for (to, (_, number)) in self.values.iter_mut().zip(samples) {
            *to = number.borrow().re();
        }
    }

    #[inline(always)]
    fn values(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Dual;

    #[test]
    fn values_and_derivatives_stand_apart_and_what_was_not_reached_is_no_number() {
        let numbers = [Dual::new(5.0, [50.0, 0.0]), Dual::new(7.0, [70.0, 1.0])];
        let (mut varied, mut one) = (Values::default(), Values::default());
        let picked = Picked::all(2);
        varied.set::<Dual<2>>(numbers.iter(), picked);
        one.set::<Dual<2>>([Dual::of(1.0); 2].iter(), picked);
        let mut recorded = Recorded::new(2, 3);
        recorded.push(0, numbers[0]);
        recorded.push(0, numbers[1]);
        recorded.add((1, 0), &varied, -2.0);
        recorded.add_slopes::<false>((1, 0), (numbers.iter(), picked), Dual::of(-2.0));
        let factor = Dual::new(0.0, [0.0, 10.0]);
        recorded.add((1, 0), &one, factor.re);
        recorded.add_slopes_of_factor::<false>((1, 0), &one, factor);
        let (values, slopes) = recorded.finish();
        assert_eq!((&values[0][..2], &values[1][..2]), (&[5.0, 7.0][..], &[-10.0, -14.0][..]));
        assert!(values[0][2].is_nan() && slopes.iter().flat_map(|s| s[2]).all(f64::is_nan));
        assert_eq!(slopes[0][..2], [[50.0, 0.0], [70.0, 1.0]]);
        assert_eq!(slopes[1][..2], [[-100.0, 10.0], [-140.0, 8.0]]);
    }
}
