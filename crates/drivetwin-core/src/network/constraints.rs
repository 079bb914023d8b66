// SPDX-License-Identifier: MIT
//! Minimal coordinates: some node speeds are independent, the rest follow from the constraints.

use super::error::CompileError;
use super::linalg::{Matrix, drop_residue, eliminate, independent_rows};
use crate::model::mechanism::Mechanism;
use crate::number::{Number, Values};
use std::ops::Deref;

/// Split of the nodes and the map `ω = N v`.
#[derive(Clone, Debug)]
pub struct Coordinates<T> {
    /// Nodes whose speeds are the coordinates v.
    pub independent: Vec<usize>,
    /// Nodes whose speeds follow, one per constraint.
    pub dependent: Vec<usize>,
    /// `ω = N v`, nodes × speeds.
    pub speeds: Matrix<T>,
    /// Magnitudes of the terms that the entries of N are sums of, without derivatives.
    pub sizes: Matrix<T>,
}

/// A linear form over the independent speeds.
#[derive(Clone, Debug)]
pub struct SpeedForm<T> {
    coefficients: Vec<T>,
    /// Largest magnitude of the terms that a coefficient is the sum of, without derivatives: the scale of their
    /// rounding.
    pub size: T,
}

impl<T> Deref for SpeedForm<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.coefficients
    }
}

/// Speeds and twists that members without mass follow.
#[derive(Clone, Debug)]
pub struct Followers<T> {
    /// Part of the node speeds beside the independent ones, nodes × basis without channels.
    pub speeds: Matrix<T>,
    /// Twists in balance, springs × (twists, 1), where a member has springs only.
    pub twists: Option<Matrix<T>>,
}

impl<T: Number> Coordinates<T> {
    /// Coordinates under `C ω = 0`; of the nodes the first in `order` are made dependent. `sizes` as for
    /// [`eliminate`]. `None` where rows of C depend on each other.
    pub fn under(mut c: Matrix<T>, mut sizes: Matrix<T::Values>, order: &[usize]) -> Option<Self> {
        let dependent = eliminate(&mut c, &mut sizes, order);
        let independent: Vec<usize> = (0..c.cols).filter(|i| !dependent.contains(i)).collect();
        let speeds = over_independent(&independent, &dependent, |i, j| -c[(i, j)], c.cols);
        let size = |i, j| T::promote(sizes[(i, j)]);
        let sizes = over_independent(&independent, &dependent, size, c.cols);
        (dependent.len() == c.rows).then_some(Self { independent, dependent, speeds, sizes })
    }

    /// A linear form over nodes, expressed over the independent speeds.
    pub fn form(&self, row: &[(usize, T)]) -> SpeedForm<T> {
        let (mut coefficients, mut largest) =
            (Vec::with_capacity(self.speeds.cols), T::Values::zero_());
        for j in 0..self.speeds.cols {
            let (mut sum, mut size) = (T::zero_(), T::Values::zero_());
            for &(node, c) in row {
                sum += c * self.speeds[(node, j)];
                size += c.re().magnitude() * self.sizes[(node, j)].re();
            }
            coefficients.push(drop_residue(sum, size));
            largest = largest.larger(size);
        }
        SpeedForm { coefficients, size: T::promote(largest) }
    }
}

/// Choose coordinates for `C ω = 0`; faults name the elements.
pub fn coordinates<T: Number>(m: &Mechanism<T>) -> Result<Coordinates<T>, CompileError> {
    let (rows, sizes) = (constraint_matrix(m, |_| None), constraint_sizes(m));
    let found = Coordinates::under(rows, sizes, &massless_first(m));
    let dependent = || CompileError::DependentConstraints { elements: dependent_elements(m) };
    let found = found.ok_or_else(dependent)?;
    if found.independent.is_empty() {
        let elements = m.constraints.iter().map(|one| one.element.to_string()).collect();
        return Err(CompileError::Immobile { elements });
    }
    Ok(found)
}

/// The map from node torques to generalised forces, `Kᵀ f`, like N, but built from the force rows: the
/// constraints as their forces act on the nodes, see [`constraint_matrix`]; `sizes` as for [`eliminate`]. `None`
/// where the efficiencies make the force balance singular (self-locking).
pub fn force_map<T: Number>(
    mut force_rows: Matrix<T>,
    mut sizes: Matrix<T::Values>,
    Coordinates { independent, dependent, .. }: &Coordinates<T>,
) -> Option<Matrix<T>> {
    let determined = eliminate(&mut force_rows, &mut sizes, dependent).len() == dependent.len();
    let entry = |i, j| -force_rows[(i, j)];
    determined.then(|| over_independent(independent, dependent, entry, force_rows.cols))
}

/// Rows of all constraints over the nodes; `efficiency` of a constraint by its index, where it has one,
/// scales the entries other than the first.
pub fn constraint_matrix<T: Number>(
    m: &Mechanism<T>,
    efficiency: impl Fn(usize) -> Option<T>,
) -> Matrix<T> {
    let mut c = Matrix::zeros(m.constraints.len(), m.nodes.len());
    for (i, constraint) in m.constraints.iter().enumerate() {
        let eta = efficiency(i).unwrap_or(T::of(1.0));
        for (position, &(node, coefficient)) in constraint.row.iter().enumerate() {
            c[(i, node)] += if position == 0 { coefficient } else { coefficient * eta };
        }
    }
    c
}

/// Magnitudes of the terms that the entries of [`constraint_matrix`] are sums of: a constraint can have a node
/// twice.
pub fn constraint_sizes<T: Number>(m: &Mechanism<T>) -> Matrix<T::Values> {
    let mut sizes = Matrix::zeros(m.constraints.len(), m.nodes.len());
    for (i, constraint) in m.constraints.iter().enumerate() {
        for &(node, coefficient) in &constraint.row {
            sizes[(i, node)] += coefficient.re().magnitude();
        }
    }
    sizes
}

/// `[I; -C_dep⁻¹ C_ind]` of `nodes` in their order, by the entries of `-C_dep⁻¹ C`: row and node.
fn over_independent<T: Number>(
    independent: &[usize],
    dependent: &[usize],
    entry: impl Fn(usize, usize) -> T,
    nodes: usize,
) -> Matrix<T> {
    let mut map = Matrix::zeros(nodes, independent.len());
    for (j, &node) in independent.iter().enumerate() {
        map[(node, j)] = T::of(1.0);
        for (i, &tied) in dependent.iter().enumerate() {
            map[(tied, j)] = entry(i, node);
        }
    }
    map
}

/// The order in which nodes are made dependent: coordinates are then mostly the speeds of real masses.
fn massless_first<T: Number>(m: &Mechanism<T>) -> Vec<usize> {
    let massless = |node: usize| {
        let of_node = m.inertias.iter().filter(|i| i.row.len() == 1 && i.row[0].0 == node);
        !of_node.map(|i| i.inertia.re()).any(|inertia| inertia.decide(|v| v > 0.0))
    };
    let (mut order, heavy): (Vec<usize>, Vec<usize>) =
        (0..m.nodes.len()).partition(|&i| massless(i));
    order.extend(heavy);
    order
}

/// Elements of a smallest set of dependent rows.
fn dependent_elements<T: Number>(m: &Mechanism<T>) -> Vec<String> {
    let (c, sizes) = (constraint_matrix(m, |_| None), constraint_sizes(m));
    let deficient = |rows: &[usize]| {
        let sizes = sizes.select_rows(rows).row_sizes();
        let sizes: Vec<T> = sizes.into_iter().map(T::promote).collect();
        independent_rows(&c.select_rows(rows), &sizes).len() < rows.len()
    };
    let mut rows: Vec<usize> = (0..c.rows).collect();
    let mut i = 0;
    while i < rows.len() {
        let mut without = rows.clone();
        without.remove(i);
        if deficient(&without) { rows = without } else { i += 1 }
    }
    rows.into_iter().map(|i| m.constraints[i].element.to_string()).collect()
}
