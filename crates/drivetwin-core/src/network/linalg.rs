// SPDX-License-Identifier: MIT
//! Dense linear algebra over [`Number`]: small systems, pivots chosen on the real part.
//!
//! Written here because the library routines need a field of floats, while derivatives must pass
//! through the solve.

use crate::number::{KernelFloat, Number, Values};
use smallvec::SmallVec;
use std::ops::Range;

/// Sum of terms that cancel that is rounding, relative to their magnitudes.
const CANCELLATION_RTOL: f64 = 1e-12;
/// Remainder of a row that depends on others, relative to its largest entry.
const RANK_RTOL: f64 = 1e-9;

/// A dense row-major matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix<T> {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    data: Vec<T>,
}

impl<T: Number> Matrix<T> {
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

    /// Matrix product; the left factor may be sparse.
    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::zeros(self.rows, other.cols);
        for i in 0..self.rows {
            let sums = out.row_mut(i);
            for (k, &a) in self.row(i).iter().enumerate() {
                if !is_zero(a) {
                    sums.iter_mut().zip(other.row(k)).for_each(|(sum, &b)| *sum += a * b);
                }
            }
        }
        out
    }

    /// Product with a matrix that is given by the entries of its columns: row and value.
    pub fn times_columns(&self, columns: &[impl AsRef<[(usize, T)]>]) -> Self {
        let mut out = Self::zeros(self.rows, columns.len());
        for i in 0..self.rows {
            for (sum, column) in out.row_mut(i).iter_mut().zip(columns) {
                for &(k, value) in column.as_ref() {
                    *sum += self[(i, k)] * value;
                }
            }
        }
        out
    }

    /// Subtract a multiple of `other` from row `i`.
    pub fn subtract_from_row(&mut self, i: usize, other: &[T], factor: T) {
        self.row_mut(i).iter_mut().zip(other).for_each(|(v, &o)| *v -= o * factor);
    }

    /// Subtract another matrix, which may have fewer rows.
    pub fn subtract(&mut self, other: &Self) {
        self.data.iter_mut().zip(&other.data).for_each(|(v, &o)| *v -= o);
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

    /// The columns named by `index`, in that order.
    pub fn select_columns(&self, index: &[usize]) -> Self {
        let mut out = Self::zeros(self.rows, index.len());
        for i in 0..self.rows {
            for (to, &k) in out.row_mut(i).iter_mut().zip(index) {
                *to = self[(i, k)];
            }
        }
        out
    }

    /// Largest magnitude among the entries.
    pub fn max_abs(&self) -> T::Values {
        self.data.iter().fold(T::Values::zero_(), |m, a| a.re().magnitude().larger(m))
    }

    /// Magnitudes of the entries.
    pub fn magnitudes(&self) -> Matrix<T::Values> {
        let data = self.data.iter().map(|v| v.re().magnitude()).collect();
        Matrix { rows: self.rows, cols: self.cols, data }
    }

    /// Largest magnitude of every row, above zero and without derivatives.
    pub fn row_sizes(&self) -> Vec<T> {
        (0..self.rows).map(|i| T::promote(largest(self.row(i)))).collect()
    }

    fn swap_rows(&mut self, i: usize, j: usize) {
        if i != j {
            for c in 0..self.cols {
                self.data.swap(i * self.cols + c, j * self.cols + c);
            }
        }
    }
}

/// The entries of a matrix that are not zero, row by row.
#[derive(Clone, Debug)]
pub struct SparseRows<T> {
    /// Column and value.
    terms: Vec<(usize, T)>,
    /// End of each row among them.
    ends: Vec<usize>,
}

impl<T: Number> SparseRows<T> {
    /// Of a dense matrix.
    pub fn of(dense: &Matrix<T>) -> Self {
        let mut terms = Vec::with_capacity(8 * dense.rows);
        let mut ends = Vec::with_capacity(dense.rows);
        for i in 0..dense.rows {
            for (j, &value) in dense.row(i).iter().enumerate() {
                if !is_zero(value) {
                    terms.push((j, value));
                }
            }
            ends.push(terms.len());
        }
        Self { terms, ends }
    }

    /// The product of row `i` with a vector.
    #[inline(always)]
    pub fn times(&self, i: usize, vector: &[T]) -> T {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        let mut sum = T::zero_();
        for &(j, value) in &self.terms[start..self.ends[i]] {
            sum += value * vector[j];
        }
        sum
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
/// of its row scale: of each row by itself, as some members have next to no mass. Pivots are large by
/// the same measure. Sparse matrices are solved in fewer operations.
pub fn solve<T: Number>(mut a: Matrix<T>, b: Matrix<T>) -> Result<Matrix<T>, usize> {
    let mut x = b;
    let one = T::Values::of(1.0);
    let mut weights: SmallVec<[_; 8]> = (0..a.rows).map(|i| one / largest(a.row(i))).collect();
    for c in 0..a.rows {
        let size = |i: usize| a[(i, c)].re().magnitude() * weights[i];
        let pivot = largest_of(size, c..a.rows);
        if size(pivot).decide(|size| size <= 1e-12) {
            return Err(c);
        }
        weights.swap(c, pivot);
        a.swap_rows(c, pivot);
        x.swap_rows(c, pivot);
        let inverse = a[(c, c)].recip();
        for r in 0..a.rows {
            let entry = a[(r, c)];
            if r != c && !is_zero(entry) {
                let factor = entry * inverse;
                // What stands before column c is not read again.
                subtract_row(&mut a, r, c, c, factor);
                subtract_row(&mut x, r, c, 0, factor);
            }
        }
        a.row_mut(c)[c..].iter_mut().for_each(|v| *v *= inverse);
        x.row_mut(c).iter_mut().for_each(|v| *v *= inverse);
    }
    Ok(x)
}

/// Bring `a` to a form in which those of the columns `order` that are linearly independent of the ones
/// before them, to `1e-9` of the size of their row, are unit vectors: number i of those that are returned has
/// its 1 in row i. Sparse matrices take fewer operations.
///
/// `sizes` are the magnitudes of the terms that the entries are sums of. They grow as the errors of the entries
/// do, and an entry that is only their rounding becomes zero (running error analysis; Higham, Accuracy and
/// Stability of Numerical Algorithms, section 3.3).
pub fn eliminate<T: Number>(
    a: &mut Matrix<T>,
    sizes: &mut Matrix<T::Values>,
    order: &[usize],
) -> Vec<usize> {
    let mut least: SmallVec<[_; 8]> = (0..a.rows).map(|i| largest(a.row(i)) * RANK_RTOL).collect();
    a.data.iter_mut().zip(&sizes.data).for_each(|(v, &size)| *v = drop_residue(*v, size));
    let mut units = Vec::with_capacity(a.rows);
    for &column in order {
        let row = units.len();
        if row == a.rows {
            break;
        }
        let size = |i: usize| a[(i, column)].re().magnitude();
        let pivot = largest_of(size, row..a.rows);
        if size(pivot).decide_with(least[pivot], |entry, least| entry <= least) {
            continue;
        }
        least.swap(row, pivot);
        a.swap_rows(row, pivot);
        sizes.swap_rows(row, pivot);
        let inverse = a[(row, column)].recip();
        let scale = inverse.re().magnitude();
        for r in 0..a.rows {
            let entry = a[(r, column)];
            if r != row && !is_zero(entry) {
                let factor = entry * inverse;
                subtract_row(a, r, row, 0, factor);
                let share = factor.re().magnitude();
                let error = (sizes[(r, column)] + share * sizes[(row, column)]) * scale;
                for j in 0..a.cols {
                    let grown = share * sizes[(row, j)] + error * a[(row, j)].re().magnitude();
                    sizes[(r, j)] += grown;
                    a[(r, j)] = drop_residue(a[(r, j)], sizes[(r, j)]);
                }
            }
        }
        let error = sizes[(row, column)] * scale;
        for j in 0..a.cols {
            sizes[(row, j)] = (sizes[(row, j)] + error * a[(row, j)].re().magnitude()) * scale;
            a[(row, j)] *= inverse;
        }
        units.push(column);
    }
    units
}

/// Rows of `a` that are linearly independent of those before them, to `1e-9` of their largest entry and to the
/// rounding of the terms that their entries are sums of: of each row the magnitude of these, as `sizes`.
pub fn independent_rows<T: Number>(a: &Matrix<T>, sizes: &[T]) -> Vec<usize> {
    let most = a.rows.min(a.cols);
    let mut kept = Vec::with_capacity(most);
    // Remainder of each kept row, with 1 as its largest entry, and the place of that entry.
    let mut left = Matrix::<T::Values>::zeros(most, a.cols);
    let mut pivots = SmallVec::<[(usize, T::Values); 8]>::new();
    for i in 0..a.rows {
        let k = kept.len();
        if k == most {
            break;
        }
        let (before, rest) = left.data.split_at_mut(k * a.cols);
        let row = &mut rest[..a.cols];
        let mut scale = T::Values::zero_();
        for (to, from) in row.iter_mut().zip(a.row(i)) {
            *to = from.re();
            scale = to.magnitude().larger(scale);
        }
        let mut terms = sizes[i].re();
        for (basis, &(pivot, size)) in before.chunks_exact(a.cols).zip(&pivots) {
            let factor = row[pivot];
            if !is_zero(factor) {
                row.iter_mut().zip(basis).for_each(|(v, &b)| *v -= factor * b);
                terms += factor.magnitude() * size;
            }
        }
        let least = (scale * RANK_RTOL).larger(terms * CANCELLATION_RTOL);
        let size = |j: usize| row[j].magnitude();
        let larger = |j: usize, k: usize| {
            if size(k).decide_with(size(j), |of_k, of_j| of_k > of_j) { k } else { j }
        };
        let pivot = (1..a.cols).fold(0, larger);
        if size(pivot).decide_with(least, |size, least| size > least) {
            let inverse = row[pivot].recip();
            row.iter_mut().for_each(|v| *v *= inverse);
            pivots.push((pivot, terms * inverse.magnitude()));
            kept.push(i);
        }
    }
    kept
}

/// Least-norm solution of the consistent system `a x = b`, which may be rank deficient: with
/// `a = l q` and orthonormal rows of `q`, `x = qᵀ l⁻¹ b`.
pub fn least_norm<T: Number>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    let Orthogonalised { kept, q, l } = orthogonalised(a);
    let mut y = b.select_rows(&kept);
    let mut x = Matrix::zeros(a.cols, b.cols);
    for i in 0..kept.len() {
        let (known, rest) = y.data.split_at_mut(i * b.cols);
        let row = &mut rest[..b.cols];
        for (j, known) in known.chunks_exact(b.cols.max(1)).enumerate() {
            row.iter_mut().zip(known).for_each(|(v, &k)| *v -= l[(i, j)] * k);
        }
        let inverse = l[(i, i)].recip();
        row.iter_mut().for_each(|v| *v *= inverse);
        for r in 0..a.cols {
            x.row_mut(r).iter_mut().zip(&*row).for_each(|(x, &y)| *x += q[(i, r)] * y);
        }
    }
    x
}

/// Factors of the independent rows of a matrix.
struct Orthogonalised<T> {
    kept: Vec<usize>,
    q: Matrix<T>,
    l: Matrix<T>,
}

/// Modified Gram-Schmidt over the rows, twice for full orthogonality.
fn orthogonalised<T: Number>(a: &Matrix<T>) -> Orthogonalised<T> {
    let dot = |a: &[T], b: &[T]| a.iter().zip(b).fold(T::zero_(), |sum, (&a, &b)| sum + a * b);
    let mut kept = Vec::with_capacity(a.rows);
    // Independent rows move up in q as they are found.
    let mut q = a.clone();
    let mut l = Matrix::zeros(a.rows, a.rows);
    for i in 0..a.rows {
        let k = kept.len();
        q.row_mut(k).copy_from_slice(a.row(i));
        let (before, rest) = q.data.split_at_mut(k * a.cols);
        let row = &mut rest[..a.cols];
        for _ in 0..2 {
            for (j, basis) in before.chunks_exact(a.cols.max(1)).enumerate() {
                let part = dot(row, basis);
                row.iter_mut().zip(basis).for_each(|(r, &b)| *r -= part * b);
                l[(k, j)] += part;
            }
        }
        let (left, length) = (dot(row, row), dot(a.row(i), a.row(i)).re());
        if left.re().decide_with(length, |left, length| left > 1e-18 * length) {
            let left = left.sqrt();
            l[(k, k)] = left;
            row.iter_mut().for_each(|r| *r /= left);
            kept.push(i);
        } else {
            l.row_mut(k).fill(T::zero_());
        }
    }
    Orthogonalised { kept, q, l }
}

/// Largest magnitude of a row, above zero.
fn largest<T: Number>(row: &[T]) -> T::Values {
    let floor = T::Values::of(f64::MIN_POSITIVE);
    row.iter().fold(floor, |largest, v| v.re().magnitude().larger(largest))
}

/// A row whose size is at least half of the largest: the last one unless an earlier one is more than twice as
/// large. Runs side by side whose sizes differ little so agree on a pivot (threshold pivoting; Duff, Erisman and
/// Reid, Direct Methods for Sparse Matrices, section 5.2).
fn largest_of<V: Values>(size: impl Fn(usize) -> V, rows: Range<usize>) -> usize {
    let larger = |i: usize, j: usize| {
        if size(j).decide_with(size(i), |of_j, of_i| of_j > 2.0 * of_i) { j } else { i }
    };
    rows.rev().reduce(larger).expect("a matrix has rows")
}

/// Subtract a multiple of row `source` from row `target`, from column `from` on.
fn subtract_row<T: Number>(
    a: &mut Matrix<T>,
    target: usize,
    source: usize,
    from: usize,
    factor: T,
) {
    let (low, high) = a.data.split_at_mut(target.max(source) * a.cols);
    let (first, second) = (&mut low[target.min(source) * a.cols..][..a.cols], &mut high[..a.cols]);
    let (target, source) = if target < source { (first, second) } else { (second, first) };
    target[from..].iter_mut().zip(&source[from..]).for_each(|(t, &s)| *t -= s * factor);
}

/// Set a sum of terms of the magnitude `size` to zero in the runs in which it is their rounding alone. The
/// derivatives stay.
pub fn drop_residue<T: Number>(sum: T, size: T::Values) -> T {
    let value = sum.re();
    let left = value.magnitude() - size * CANCELLATION_RTOL;
    let rounding = left.mask_where(|left| left <= 0.0);
    if rounding == 0 {
        return sum;
    }
    sum - T::promote(T::Values::zero_().replace_where(rounding, value))
}

/// True if a number is zero in every run and with all its derivatives. Its products may then be left out.
pub fn is_zero<T: Number>(value: T) -> bool {
    value.re().mask_where(|v| v != 0.0) == 0 && value.is_constant()
}

/// True if the value is zero in the run that decides, see
/// [`Values::decide`](crate::number::Values::decide).
pub fn is_nothing<T: Number>(value: T) -> bool {
    value.re().decide(|v| v == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn matrix(rows: &[&[f64]]) -> Matrix<f64> {
        let mut all = Matrix::zeros(rows.len(), rows[0].len());
        rows.iter().enumerate().for_each(|(i, row)| all.row_mut(i).copy_from_slice(row));
        all
    }

    #[test]
    fn what_is_left_of_terms_that_cancel_is_measured_by_these_terms() {
        assert_eq!(drop_residue(1.0 + 2e-16 - 1.0, 2.0), 0.0);
        assert_eq!(drop_residue(1e-11, 1.0), 1e-11);
        assert_eq!(drop_residue(1e-20, 1e-20), 1e-20);
    }

    #[test]
    fn a_row_of_rounding_is_independent_of_none() {
        let residue = matrix(&[&[1e-17, -2e-17]]);
        assert_eq!(independent_rows(&residue, &[1.0]), Vec::<usize>::new());
        assert_eq!(independent_rows(&residue, &[1e-17]), [0]);
    }

    #[test]
    fn the_rounding_of_a_row_grows_where_others_are_subtracted() {
        // The second row is 1e7 times the first, which is what is left of terms of size 1.
        let rows = matrix(&[&[1e-7, 2e-7 + 1e-15], &[1.0, 2.0]]);
        assert_eq!(independent_rows(&rows, &[1e-7, 1.0]), [0, 1]);
        assert_eq!(independent_rows(&rows, &[1.0, 1.0]), [0]);
    }

    proptest! {
        /// A train of gears to and fro, with a last row that states anew what follows from the others.
        #[test]
        fn ratios_that_cancel_leave_nothing(
            ratios in prop::collection::vec((0.01..100.0_f64, any::<bool>()), 1..8),
            share in 0.1..10.0_f64,
        ) {
            let nodes = ratios.len() + 2;
            let signed = |&(size, positive): &(f64, bool)| if positive { size } else { -size };
            let ratios: Vec<f64> = ratios.iter().map(signed).collect();
            let whole: f64 = ratios.iter().product();
            let mut c = Matrix::zeros(nodes, nodes);
            for (i, ratio) in ratios.iter().copied().chain([1.0 / whole]).enumerate() {
                (c[(i, i)], c[(i, i + 1)]) = (1.0, -ratio);
            }
            (c[(nodes - 1, 0)], c[(nodes - 1, nodes - 1)]) = (share, -share);
            let (mut sizes, order) = (c.magnitudes(), (0..nodes).collect::<Vec<_>>());
            let units = eliminate(&mut c, &mut sizes, &order);
            prop_assert_eq!(units.len(), nodes - 1);
            prop_assert!((0..nodes).all(|j| c[(nodes - 1, j)] == 0.0));
        }
    }
}
