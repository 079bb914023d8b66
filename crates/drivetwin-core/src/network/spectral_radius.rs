// SPDX-License-Identifier: MIT
//! Bound of the spectral radius of a linear motion.

use super::linalg::{Matrix, is_zero};
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
    let (mut filled, mut ends) = (Vec::new(), Vec::new());
    for _ in 0..4 {
        power.list_filled(&mut filled, &mut ends);
        power.square(&filled, &ends, &mut square);
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

    /// Chunks that are not zero: their numbers within their row, row after row, and where each row ends.
    fn list_filled(&self, filled: &mut Vec<usize>, ends: &mut Vec<usize>) {
        filled.clear();
        ends.clear();
        for row in self.chunks.chunks_exact(self.size.div_ceil(CHUNK)) {
            for (c, chunk) in row.iter().enumerate() {
                if !chunk.iter().all(|&v| is_zero(v)) {
                    filled.push(c);
                }
            }
            ends.push(filled.len());
        }
    }

    /// The matrix times itself, whose chunks that are not zero are given as by [`Self::list_filled`]. Of a chain
    /// these are few: its sixteenth power reaches sixteen neighbours.
    fn square(&self, filled: &[usize], ends: &[usize], out: &mut Self) {
        let width = self.size.div_ceil(CHUNK);
        out.chunks.fill([V::zero_(); CHUNK]);
        let of_row = |k: usize| &filled[if k == 0 { 0 } else { ends[k - 1] }..ends[k]];
        for i in 0..self.size {
            let products = &mut out.chunks[i * width..(i + 1) * width];
            for &block in of_row(i) {
                for (at, &a) in self.chunks[i * width + block].iter().enumerate() {
                    let k = block * CHUNK + at;
                    if k >= self.size || is_zero(a) {
                        continue;
                    }
                    for &c in of_row(k) {
                        let b = &self.chunks[k * width + c];
                        for (sum, &b) in products[c].iter_mut().zip(b) {
                            *sum += a * b;
                        }
                    }
                }
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
