// SPDX-License-Identifier: MIT
//! Inverse covariance of samples whose noise is their own and that of a Markov chain of states.
//!
//! With the rows H by which samples y see the states x, the variance R of their own noise and the prior
//! precision P⁻¹ of the states, the covariance is H·P·Hᵀ + R, and by the matrix inversion lemma
//!
//! ```text
//! Σ⁻¹ y = R⁻¹ (y - H x),   (P⁻¹ + Hᵀ R⁻¹ H) x = Hᵀ R⁻¹ y
//! ```

use super::banded::BandedFactor;
use super::simd::{Kernel, dispatch_simd};

/// Samples with their view of the states.
#[derive(Clone, Copy, Debug)]
pub struct Whitening<'w> {
    /// Cholesky factor of P⁻¹ + Hᵀ R⁻¹ H.
    pub factor: BandedFactor<'w>,
    /// Number of states of an instant.
    pub states: usize,
    /// Row of each sample over the states of its instant, samples × states.
    pub rows: &'w [f64],
    /// First of these states.
    pub first: &'w [u32],
    /// Variance of each sample's own noise.
    pub variance: &'w [f64],
}

impl Whitening<'_> {
    /// Apply Σ⁻¹ to columns (samples × count, by rows).
    ///
    /// # Panics
    ///
    /// If the lengths do not agree or a sample sees a state that is not there.
    pub fn apply(self, columns: &[f64], count: usize) -> Vec<f64> {
        let samples = self.first.len();
        assert_eq!(self.rows.len(), samples * self.states, "a row each");
        assert_eq!(self.variance.len(), samples, "a variance each");
        assert_eq!(columns.len(), samples * count, "an entry for each sample and column");
        let mut states = vec![0.0; self.factor.size * count];
        dispatch_simd(Gather { whitening: self, columns, states: &mut states, count });
        self.factor.solve(&mut states, count);
        let mut found = columns.to_vec();
        dispatch_simd(Subtract { whitening: self, columns: &mut found, states: &states, count });
        found
    }

    /// Row of a sample, and the place of its states in columns of a number.
    #[inline(always)]
    fn sample(&self, i: usize, count: usize) -> impl Iterator<Item = (f64, usize)> {
        let start = self.first[i] as usize;
        let row = self.rows[i * self.states..][..self.states].iter().copied();
        let seen = row.enumerate().filter(|(_, weight)| *weight != 0.0);
        seen.map(move |(state, weight)| (weight, (start + state) * count))
    }
}

/// Hᵀ R⁻¹ y.
struct Gather<'g> {
    whitening: Whitening<'g>,
    columns: &'g [f64],
    states: &'g mut [f64],
    count: usize,
}

impl Kernel for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { whitening, columns, states, count } = self;
        for (i, &variance) in whitening.variance.iter().enumerate() {
            let sample = &columns[i * count..][..count];
            for (weight, place) in whitening.sample(i, count) {
                add::<F>(&mut states[place..][..count], weight / variance, sample);
            }
        }
    }
}

/// R⁻¹ (y - H x), in place of y.
struct Subtract<'s> {
    whitening: Whitening<'s>,
    columns: &'s mut [f64],
    states: &'s [f64],
    count: usize,
}

impl Kernel for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { whitening, columns, states, count } = self;
        for (i, &variance) in whitening.variance.iter().enumerate() {
            let sample = &mut columns[i * count..][..count];
            for (weight, place) in whitening.sample(i, count) {
                add::<F>(sample, -weight, &states[place..][..count]);
            }
            sample.iter_mut().for_each(|value| *value /= variance);
        }
    }
}

/// `sum + factor · term`.
#[inline(always)]
fn add<const F: bool>(sum: &mut [f64], factor: f64, term: &[f64]) {
    for (sum, term) in sum.iter_mut().zip(term) {
        *sum = if F { factor.mul_add(*term, *sum) } else { *sum + factor * *term };
    }
}
