// SPDX-License-Identifier: MIT
//! Dense linear algebra over [`Real`]: small systems, pivots chosen on the real part.
//!
//! Written here because the library routines need a field of floats, while derivatives must pass
//! through the solve.

use crate::number::Real;

/// A dense row-major matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix<T> {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    data: Vec<T>,
}

impl<T: Real> Matrix<T> {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![T::zero_(); rows * cols] }
    }

    /// Row `i` as a slice.
    pub fn row(&self, i: usize) -> &[T] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// Row `i` as a mutable slice.
    pub fn row_mut(&mut self, i: usize) -> &mut [T] {
        &mut self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// Matrix product.
    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::zeros(self.rows, other.cols);
        for i in 0..self.rows {
            for k in 0..self.cols {
                let a = self[(i, k)];
                for j in 0..other.cols {
                    out[(i, j)] += a * other[(k, j)];
                }
            }
        }
        out
    }

    /// Transpose.
    pub fn transposed(&self) -> Self {
        let mut out = Self::zeros(self.cols, self.rows);
        for i in 0..self.rows {
            for j in 0..self.cols {
                out[(j, i)] = self[(i, j)];
            }
        }
        out
    }

    /// The rows named by `index`, in that order.
    pub fn select_rows(&self, index: &[usize]) -> Self {
        let mut out = Self::zeros(index.len(), self.cols);
        for (i, &k) in index.iter().enumerate() {
            out.row_mut(i).copy_from_slice(self.row(k));
        }
        out
    }

    /// Largest magnitude among the entries.
    pub fn max_abs(&self) -> f64 {
        self.data.iter().fold(0.0, |m, a| m.max(a.re().abs()))
    }

    fn swap_rows(&mut self, i: usize, j: usize) {
        if i != j {
            for c in 0..self.cols {
                self.data.swap(i * self.cols + c, j * self.cols + c);
            }
        }
    }
}

impl<T> std::ops::Index<(usize, usize)> for Matrix<T> {
    type Output = T;
    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.data[i * self.cols + j]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Matrix<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        &mut self.data[i * self.cols + j]
    }
}

/// Solve `a x = b` for a square matrix; `Err(column)` where the matrix is singular to `1e-12`
/// of its row scale.
pub fn solve<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Result<Matrix<T>, usize> {
    let n = a.rows;
    let (mut a, mut x) = (a.clone(), b.clone());
    let scale = a.max_abs().max(f64::MIN_POSITIVE);
    for c in 0..n {
        let pivot = largest_in_column(&a, c, c);
        if a[(pivot, c)].re().abs() <= 1e-12 * scale {
            return Err(c);
        }
        a.swap_rows(c, pivot);
        x.swap_rows(c, pivot);
        let inverse = a[(c, c)].recip();
        for r in 0..n {
            if r != c {
                let factor = a[(r, c)] * inverse;
                subtract_row(&mut a, r, c, factor);
                subtract_row(&mut x, r, c, factor);
            }
        }
        a.row_mut(c).iter_mut().for_each(|v| *v *= inverse);
        x.row_mut(c).iter_mut().for_each(|v| *v *= inverse);
    }
    Ok(x)
}

/// Rows of `a` that are linearly independent to `1e-9`, in order of choice.
pub fn independent_rows<T: Real>(a: &Matrix<T>) -> Vec<usize> {
    let mut work = a.clone();
    let scale = a.max_abs();
    let mut chosen: Vec<usize> = Vec::new();
    for _ in 0..a.rows.min(a.cols) {
        let mut best = (0, 0, 1e-9 * scale);
        for i in (0..a.rows).filter(|i| !chosen.contains(i)) {
            for j in 0..a.cols {
                if work[(i, j)].re().abs() > best.2 {
                    best = (i, j, work[(i, j)].re().abs());
                }
            }
        }
        let (row, col, size) = best;
        if size <= 1e-9 * scale {
            break;
        }
        for r in (0..a.rows).filter(|&r| r != row) {
            let factor = work[(r, col)] / work[(row, col)];
            subtract_row(&mut work, r, row, factor);
        }
        chosen.push(row);
    }
    chosen
}

/// Least-norm solution of the consistent system `a x = b`, which may be rank deficient.
pub fn least_norm<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    let keep = independent_rows(a);
    let (a, b) = (a.select_rows(&keep), b.select_rows(&keep));
    let at = a.transposed();
    let y = solve(&a.times(&at), &b).expect("independent rows have a regular Gram matrix");
    at.times(&y)
}

fn largest_in_column<T: Real>(a: &Matrix<T>, c: usize, from: usize) -> usize {
    (from..a.rows)
        .max_by(|&i, &j| a[(i, c)].re().abs().total_cmp(&a[(j, c)].re().abs()))
        .unwrap_or(from)
}

fn subtract_row<T: Real>(a: &mut Matrix<T>, target: usize, source: usize, factor: T) {
    for j in 0..a.cols {
        let s = a[(source, j)];
        a[(target, j)] -= s * factor;
    }
}
