// SPDX-License-Identifier: MIT
//! Numbers on a grid by their parts: the value, and the derivative by every parameter.

use crate::number::Real;
use crate::solve::BLOCK;
use std::borrow::Borrow;

/// Values of outputs on a grid with their derivatives, filled as a run comes along.
#[derive(Clone, Debug)]
pub(super) struct Recorded {
    /// Points of the grid.
    points: usize,
    /// A column per output, as long as the run has come.
    values: Vec<Vec<f64>>,
    /// Parameters × outputs × points, filled as far as the columns.
    derivatives: Vec<f64>,
}

impl Recorded {
    /// Nothing yet, for numbers of type `T`.
    pub fn new<T: Real>(outputs: usize, points: usize) -> Self {
        let column = || Vec::with_capacity(points);
        let values = std::iter::repeat_with(column).take(outputs).collect();
        Self { points, values, derivatives: vec![0.0; T::PARAMETERS * outputs * points] }
    }

    /// The next value of an output.
    pub fn push<T: Real>(&mut self, output: usize, value: T) {
        let at = self.values[output].len();
        self.values[output].push(value.re());
        for parameter in 0..T::PARAMETERS {
            self.slopes(parameter, output)[at] = value.derivative(parameter);
        }
    }

    /// Number of values of an output.
    pub fn length(&self, output: usize) -> usize {
        self.values[output].len()
    }

    /// Add a multiple of a quantity to the values of an output from `from` on, where there are none to
    /// nothing.
    #[inline(always)]
    pub fn add<T: Real>(&mut self, (output, from): (usize, usize), source: &Parts, factor: T) {
        let (values, sums) = (source.part(0), &mut self.values[output]);
        if sums.len() > from {
            add(&mut sums[from..], values, factor.re());
        } else {
            sums.extend(values.iter().map(|value| factor.re() * value));
        }
        for parameter in 0..T::PARAMETERS {
            let slopes = &mut self.slopes(parameter, output)[from..];
            if !source.constant {
                add(slopes, source.part(1 + parameter), factor.re());
            }
            if factor.derivative(parameter) != 0.0 {
                add(slopes, values, factor.derivative(parameter));
            }
        }
    }

    /// Fill an output up to a length with zeros.
    pub fn fill(&mut self, output: usize, length: usize) {
        self.values[output].resize(length, 0.0);
    }

    /// Derivatives of an output by a parameter.
    #[inline(always)]
    fn slopes(&mut self, parameter: usize, output: usize) -> &mut [f64] {
        let row = parameter * self.values.len() + output;
        &mut self.derivatives[row * self.points..(row + 1) * self.points]
    }

    /// Values by output, and derivatives, NaN where the run did not come.
    pub fn finish(mut self) -> (Vec<Vec<f64>>, Vec<f64>) {
        let outputs = self.values.len();
        for (row, slopes) in self.derivatives.chunks_exact_mut(self.points).enumerate() {
            slopes[self.values[row % outputs].len()..].fill(f64::NAN);
        }
        for column in &mut self.values {
            column.resize(self.points, f64::NAN);
        }
        (self.values, self.derivatives)
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

/// One quantity over the samples of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    /// Whether it has been taken up.
    pub known: bool,
    /// Number of samples.
    count: usize,
    /// Values, then derivatives by every parameter, [`BLOCK`] of each.
    parts: Vec<f64>,
    /// Whether no value depends on a parameter: all derivatives are zero.
    constant: bool,
}

impl Parts {
    /// Take up the picked samples.
    #[inline(always)]
    pub fn set<T: Real>(&mut self, samples: impl Iterator<Item: Borrow<T>>, picked: Picked) {
        self.parts.resize((1 + T::PARAMETERS) * BLOCK, 0.0);
        (self.known, self.constant, self.count) = (true, true, picked.count());
        if !T::DERIVATIVES && picked.are_all() {
            for (to, number) in self.parts[..self.count].iter_mut().zip(samples) {
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
        for (k, (_, number)) in samples.enumerate() {
            let number = number.borrow();
            self.parts[k] = number.re();
            self.constant &= number.is_constant();
            for parameter in 0..T::PARAMETERS {
                self.parts[(1 + parameter) * BLOCK + k] = number.derivative(parameter);
            }
        }
    }

    #[inline(always)]
    fn part(&self, part: usize) -> &[f64] {
        &self.parts[part * BLOCK..][..self.count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Dual;

    #[test]
    fn values_and_derivatives_stand_apart_and_what_was_not_reached_is_no_number() {
        let numbers = [Dual::new(5.0, [50.0, 0.0]), Dual::new(7.0, [70.0, 1.0])];
        let (mut varied, mut one) = (Parts::default(), Parts::default());
        varied.set::<Dual<2>>(numbers.iter(), Picked::all(2));
        one.set::<Dual<2>>([Dual::of(1.0); 2].iter(), Picked::all(2));
        let mut recorded = Recorded::new::<Dual<2>>(2, 3);
        recorded.push(0, numbers[0]);
        recorded.push(0, numbers[1]);
        recorded.add((1, 0), &varied, Dual::<2>::of(-2.0));
        recorded.add((1, 0), &one, Dual::new(0.0, [0.0, 10.0]));
        let (values, slopes) = recorded.finish();
        assert_eq!((&values[0][..2], &values[1][..2]), (&[5.0, 7.0][..], &[-10.0, -14.0][..]));
        assert!(values[0][2].is_nan() && slopes.iter().skip(2).step_by(3).all(|d| d.is_nan()));
        let reached = slopes.iter().filter(|d| !d.is_nan()).copied().collect::<Vec<f64>>();
        assert_eq!(reached, [50.0, 70.0, -100.0, -140.0, 0.0, 1.0, 10.0, 8.0]);
    }
}
