// SPDX-License-Identifier: MIT
//! Holding torques (THEORY section 1) of friction elements at rest, of gears held by their loss and of
//! prescribed speeds, with the resulting accelerations.

use super::constraints::{Coordinates, force_map};
use super::linalg::{Matrix, independent_rows, least_norm, solve};
use crate::number::{Number, Values};

/// Motion under held speeds: `A a + B τ = f`, `G a = g`, without `g` zero.
///
/// Rows are dealt with as constraints are: some speeds follow from the others, and the torques from the balance
/// of these. The shorter way, τ from `G A⁻¹ B`, loses all digits where a member has next to no mass.
pub struct ConstraintSolver<'a, T> {
    /// A: generalised force per acceleration, speeds × speeds.
    pub inertia: &'a Matrix<T>,
    /// B: generalised force that each torque takes away, speeds × rows; none where that is `Gᵀ`.
    pub acting: Option<Matrix<T>>,
    /// G: what is held, over the speeds, rows × speeds; those prescribed come last.
    pub rows: Matrix<T>,
    /// Magnitudes of the terms that the entries of each row are sums of.
    pub sizes: Vec<T>,
    /// Number of rows at rest; the others are prescribed.
    pub resting: usize,
    /// Rows at rest that no torque overcomes (one-way clutches).
    pub firm: Vec<usize>,
}

/// Accelerations, speeds × columns, and torques, rows × columns, for each column of f and g.
pub struct ConstraintForces<T> {
    pub acceleration: Matrix<T>,
    pub torque: Matrix<T>,
    /// True if more rows are held than there are speeds.
    pub redundant: bool,
}

impl<T: Number> ConstraintSolver<'_, T> {
    /// Solve for the accelerations and the holding torques. Prescribed rows take precedence over rows that
    /// contradict them, then firm ones. Torques of redundant rows minimise `Σ (τ_j / weight_j)²`. `None` if the
    /// efficiencies leave the accelerations undetermined.
    pub fn solve(
        &self,
        f: &Matrix<T>,
        g: Option<&Matrix<T>>,
        weights: impl FnOnce() -> Vec<T>,
    ) -> Option<ConstraintForces<T>> {
        let kept = self.independent();
        let (left, acceleration) = self.motion(&kept, f, g)?;
        let redundant = kept.len() < self.rows.rows;
        let torque = if redundant {
            let all: Vec<usize> = (0..f.rows).collect();
            self.shared(&self.balance(&all, f, &acceleration), &weights())
        } else {
            let balance = self.balance(&left.dependent, f, &acceleration);
            let found = solve(self.acting(&kept).select_rows(&left.dependent), balance).ok()?;
            let place = |row| kept.iter().position(|&k| k == row);
            found.select_rows(&(0..kept.len()).filter_map(place).collect::<Vec<_>>())
        };
        Some(ConstraintForces { acceleration, torque, redundant })
    }

    /// Change of the speeds by impulses that reduce the held speeds by `excess` (rows × 1, rad/s). `None` as
    /// in [`Self::solve`].
    pub fn stop(&self, excess: &Matrix<T>) -> Option<Matrix<T>> {
        let mut taken = Matrix::zeros(excess.rows, 1);
        taken.subtract(excess);
        let nothing = Matrix::zeros(self.inertia.rows, 1);
        self.motion(&self.independent(), &nothing, Some(&taken)).map(|(_, change)| change)
    }

    /// Impulses of the rows that change the speeds so.
    pub fn impulses(&self, change: &Matrix<T>) -> Matrix<T> {
        let all: Vec<usize> = (0..change.rows).collect();
        let balance = self.balance(&all, &Matrix::zeros(change.rows, 1), change);
        self.shared(&balance, &vec![T::of(1.0); self.rows.rows])
    }

    /// Rows that are independent of each other: prescribed ones first, then firm ones, as others give way
    /// to these.
    fn independent(&self) -> Vec<usize> {
        let yielding = (0..self.resting).filter(|row| !self.firm.contains(row));
        let firm = self.firm.iter().copied();
        let order: Vec<usize> =
            (self.resting..self.rows.rows).chain(firm).chain(yielding).collect();
        let sizes: Vec<T> = order.iter().map(|&row| self.sizes[row]).collect();
        let found = independent_rows(&self.rows.select_rows(&order), &sizes);
        found.into_iter().map(|i| order[i]).collect()
    }

    /// Coordinates left free by the rows `kept`, and the accelerations.
    fn motion(
        &self,
        kept: &[usize],
        f: &Matrix<T>,
        g: Option<&Matrix<T>>,
    ) -> Option<(Coordinates<T>, Matrix<T>)> {
        let rows = self.rows.select_rows(kept);
        let sizes = rows.magnitudes();
        let left = Coordinates::under(rows, sizes, &self.lightest_first())?;
        let forces = match &self.acting {
            Some(_) => {
                let acting = self.acting(kept).transposed();
                let sizes = acting.magnitudes();
                force_map(acting, sizes, &left)?.transposed()
            }
            None => left.speeds.transposed(),
        };
        let mass = forces.times(self.inertia).times(&left.speeds);
        let Some(g) = g else {
            let free = solve(mass, forces.times(f)).ok()?;
            let acceleration = left.speeds.times(&free);
            return Some((left, acceleration));
        };
        let rows = self.rows.select_rows(kept).select_columns(&left.dependent);
        let given = solve(rows, g.select_rows(kept)).ok()?;
        let mut driving = f.clone();
        driving.subtract(&self.inertia.select_columns(&left.dependent).times(&given));
        let mut acceleration = left.speeds.times(&solve(mass, forces.times(&driving)).ok()?);
        for (i, &speed) in left.dependent.iter().enumerate() {
            acceleration.subtract_from_row(speed, given.row(i), T::of(-1.0));
        }
        Some((left, acceleration))
    }

    /// Speeds by their inertia: those of light members follow, as they lose fewer digits of the momentum.
    fn lightest_first(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.inertia.rows).collect();
        let heavier = |i: usize, j: usize| {
            let [i, j] = [i, j].map(|k| self.inertia[(k, k)].re().magnitude());
            i.decide_with(j, |i, j| i > j)
        };
        for end in 1..order.len() {
            for i in (1..=end).rev() {
                if !heavier(order[i - 1], order[i]) {
                    break;
                }
                order.swap(i - 1, i);
            }
        }
        order
    }

    /// Of some speeds, the force that the torques take away: `f - A a`.
    fn balance(&self, speeds: &[usize], f: &Matrix<T>, acceleration: &Matrix<T>) -> Matrix<T> {
        let mut balance = f.select_rows(speeds);
        balance.subtract(&self.inertia.select_rows(speeds).times(acceleration));
        balance
    }

    /// B of some rows.
    pub fn acting(&self, rows: &[usize]) -> Matrix<T> {
        match &self.acting {
            Some(acting) => acting.select_columns(rows),
            None => self.rows.select_rows(rows).transposed(),
        }
    }

    /// Torques of all rows that exert `balance` together.
    fn shared(&self, balance: &Matrix<T>, weights: &[T]) -> Matrix<T> {
        let all: Vec<usize> = (0..self.rows.rows).collect();
        let mut scaled = self.acting(&all);
        for r in 0..scaled.rows {
            scaled.row_mut(r).iter_mut().zip(weights).for_each(|(b, &weight)| *b *= weight);
        }
        let mut torque = least_norm(&scaled, balance);
        for (i, &weight) in weights.iter().enumerate() {
            torque.row_mut(i).iter_mut().for_each(|t| *t *= weight);
        }
        torque
    }
}
