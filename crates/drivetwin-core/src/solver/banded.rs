// SPDX-License-Identifier: MIT
//! Solution with a banded Cholesky factor for many columns at once.
//!
//! LAPACK solves column by column, and each runs through the whole factor. Here the columns stand side by side
//! in memory, so that the factor is read once for a block of them and the loop over the block is one of vectors.

use super::simd::{Kernel, dispatch_simd};

/// Lower Cholesky factor of a banded matrix: entry (j + i, j) stands at `bands[i · size + j]`.
#[derive(Clone, Copy, Debug)]
pub struct BandedFactor<'f> {
    /// Diagonal first, each of `size` entries.
    pub bands: &'f [f64],
    /// Number of rows and columns.
    pub size: usize,
}

/// Columns of a wide and of a narrow block.
const WIDE: usize = 16;
const NARROW: usize = 4;

impl BandedFactor<'_> {
    /// Replace `right` (size × columns, by rows) by the solution of L·Lᵀ·x = right.
    ///
    /// # Panics
    ///
    /// If `bands` or `right` is not as long as `size` and `columns` tell.
    pub fn solve(self, right: &mut [f64], columns: usize) {
        assert!(self.size > 0 && self.bands.len().is_multiple_of(self.size), "whole bands");
        assert_eq!(right.len(), self.size * columns, "an entry for each row and column");
        dispatch_simd(Solution { factor: self, right, columns });
    }
}

/// [`BandedFactor::solve`], to be dispatched.
struct Solution<'s> {
    factor: BandedFactor<'s>,
    right: &'s mut [f64],
    columns: usize,
}

impl Kernel for Solution<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(mut self) {
        let mut first = 0;
        while first + WIDE <= self.columns {
            self.substitute::<F, WIDE>(first);
            first += WIDE;
        }
        while first + NARROW <= self.columns {
            self.substitute::<F, NARROW>(first);
            first += NARROW;
        }
        for last in first..self.columns {
            self.substitute::<F, 1>(last);
        }
    }
}

impl Solution<'_> {
    /// Substitute forwards and backwards in `B` columns.
    #[inline(always)]
    fn substitute<const F: bool, const B: usize>(&mut self, first: usize) {
        let BandedFactor { bands, size } = self.factor;
        let width = bands.len() / size;
        for row in 0..size {
            let mut sum = self.block::<B>(row, first);
            for i in 1..width.min(row + 1) {
                let known = self.block::<B>(row - i, first);
                subtract::<F, B>(&mut sum, bands[i * size + row - i], &known);
            }
            self.store(row, first, sum, bands[row]);
        }
        for row in (0..size).rev() {
            let mut sum = self.block::<B>(row, first);
            for i in 1..width.min(size - row) {
                let known = self.block::<B>(row + i, first);
                subtract::<F, B>(&mut sum, bands[i * size + row], &known);
            }
            self.store(row, first, sum, bands[row]);
        }
    }

    #[inline(always)]
    fn block<const B: usize>(&self, row: usize, first: usize) -> [f64; B] {
        let entries = &self.right[row * self.columns + first..];
        *entries.first_chunk().expect("a whole block")
    }

    #[inline(always)]
    fn store<const B: usize>(&mut self, row: usize, first: usize, sum: [f64; B], pivot: f64) {
        let entries = &mut self.right[row * self.columns + first..][..B];
        for k in 0..B {
            entries[k] = sum[k] / pivot;
        }
    }
}

/// `sum - factor · known`.
#[inline(always)]
fn subtract<const F: bool, const B: usize>(sum: &mut [f64; B], factor: f64, known: &[f64; B]) {
    for k in 0..B {
        sum[k] = if F { (-factor).mul_add(known[k], sum[k]) } else { sum[k] - factor * known[k] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_product_of_factor_and_solution_is_the_right_side(
            size in 1_usize..40,
            columns in 0_usize..40,
            width in 1_usize..9,
            seed in 0_u64..1000,
        ) {
            let number = |i: usize| ((i as f64 + seed as f64) * 0.754_877_666).fract() - 0.5;
            let bands: Vec<f64> = (0..width * size)
                .map(|k| if k < size { 2.0 + number(k) } else { 0.3 * number(k) })
                .collect();
            let right: Vec<f64> = (0..size * columns).map(number).collect();
            let mut found = right.clone();
            BandedFactor { bands: &bands, size }.solve(&mut found, columns);
            let entry = |row: usize, column: usize| match row.checked_sub(column) {
                Some(i) if i < width => bands[i * size + column],
                _ => 0.0,
            };
            for column in 0..columns {
                let x = |row: usize| found[row * columns + column];
                let back: Vec<f64> =
                    (0..size).map(|j| (j..size).map(|i| entry(i, j) * x(i)).sum()).collect();
                for row in 0..size {
                    let product: f64 = (0..=row).map(|j| entry(row, j) * back[j]).sum();
                    prop_assert!((product - right[row * columns + column]).abs() < 1e-12);
                }
            }
        }
    }
}
