// SPDX-License-Identifier: MIT
//! Bound of the spectral radius of a linear motion.

use super::linalg::Matrix;
use crate::number::{Number, Values};

/// Entries of a row that are multiplied together.
const CHUNK: usize = 4;

/// A square matrix by rows of whole chunks.
struct Chunked<V> {
    size: usize,
    chunks: Vec<[V; CHUNK]>,
}

/// Estimate of the spectral radius of the square matrix A that `rows` begin with, one per state: from
/// `A^16`, of which a bad scaling of the states counts only by its sixteenth root.
pub fn spectral_radius_bound<T: Number>(rows: &Matrix<T>) -> T::Values {
    let mut power = Chunked::zeros(rows.rows);
    for i in 0..rows.rows {
        for (to, from) in power.row_mut(i).iter_mut().zip(&rows.row(i)[..rows.rows]) {
            *to = from.re();
        }
    }
    let least = T::Values::of(f64::MIN_POSITIVE);
    let size = power.max_abs();
    let inverse = size.larger(least).recip();
    power.chunks.as_flattened_mut().iter_mut().for_each(|v| *v *= inverse);
    let mut square = Chunked::zeros(rows.rows);
    for _ in 0..4 {
        power.square(&mut square);
        std::mem::swap(&mut power, &mut square);
    }
    let root = (0..4).fold(power.max_abs().larger(least), |root, _| root.sqrt());
    size * root
}

impl<V: Values> Chunked<V> {
    fn zeros(size: usize) -> Self {
        Self { size, chunks: vec![[V::zero_(); CHUNK]; size * size.div_ceil(CHUNK)] }
    }

    fn row_mut(&mut self, i: usize) -> &mut [V] {
        let width = self.size.div_ceil(CHUNK);
        self.chunks[i * width..(i + 1) * width].as_flattened_mut()
    }

    fn max_abs(&self) -> V {
        self.chunks
            .as_flattened()
            .iter()
            .fold(V::zero_(), |largest, v| v.magnitude().larger(largest))
    }

    /// The matrix times itself.
    fn square(&self, out: &mut Self) {
        let width = self.size.div_ceil(CHUNK);
        for (row, products) in
            self.chunks.chunks_exact(width).zip(out.chunks.chunks_exact_mut(width))
        {
            for (c, product) in products.iter_mut().enumerate() {
                let mut sum = [V::zero_(); CHUNK];
                for (&a, b) in row.as_flattened().iter().zip(self.chunks[c..].iter().step_by(width))
                {
                    for i in 0..CHUNK {
                        sum[i] += a * b[i];
                    }
                }
                *product = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oscillation_and_decay_are_as_fast_as_their_eigenvalues_however_the_states_are_scaled() {
        for (size, scale) in [(2, 1.0), (3, 1e5), (6, 1e9)] {
            // ω = 70 rad/s over two states of unequal scale; the others decay with 1/s.
            let mut a = Matrix::zeros(size, size + 3);
            (a[(0, 1)], a[(1, 0)]) = (70.0 * scale, -70.0 / scale);
            (2..size).for_each(|i| a[(i, i)] = -1.0);
            let found = spectral_radius_bound(&a);
            assert!((found / 70.0 - 1.0).abs() < 1e-12, "{found} rad/s for {scale}");
        }
        assert_eq!(spectral_radius_bound(&Matrix::<f64>::zeros(4, 7)), 0.0);
    }
}
