// SPDX-License-Identifier: MIT
//! Minimal coordinates: some node speeds are independent, the rest follow from the constraints.

use super::error::CompileError;
use super::linalg::{Matrix, independent_columns, independent_rows, solve};
use crate::model::mechanism::{Constraint, Mechanism};
use crate::number::Real;

/// Split of the nodes and the map `ω = N v`.
#[derive(Clone, Debug)]
pub struct Coordinates<T> {
    /// Nodes whose speeds are the coordinates v.
    pub independent: Vec<usize>,
    /// Nodes whose speeds follow, one per constraint.
    pub dependent: Vec<usize>,
    /// `ω = N v`, nodes × speeds.
    pub speeds: Matrix<T>,
}

/// Choose coordinates for `C ω = 0`; faults name the elements.
pub fn coordinates<T: Real>(m: &Mechanism<T>) -> Result<Coordinates<T>, CompileError> {
    let c = constraint_matrix(m, |_, _| None);
    let dependent = dependent_nodes(m, &c);
    if dependent.len() < c.rows {
        return Err(CompileError::DependentConstraints { elements: dependent_elements(m, &c) });
    }
    let independent: Vec<usize> = (0..m.nodes.len()).filter(|i| !dependent.contains(i)).collect();
    if independent.is_empty() {
        return Err(CompileError::Immobile);
    }
    let speeds = complete(&c, &independent, &dependent)
        .expect("the dependent nodes were chosen to make their block regular");
    Ok(Coordinates { independent, dependent, speeds })
}

/// The map from node torques to generalised forces, `Kᵀ f`, for one direction of power through each
/// lossy gear: like N, but built from the force rows, whose driven entries carry the efficiency.
/// `None` where the efficiencies make the force balance singular (self-locking).
pub fn force_map<T: Real>(
    m: &Mechanism<T>,
    c: &Coordinates<T>,
    efficiency: impl Fn(&Constraint<T>, usize) -> Option<T>,
) -> Option<(Matrix<T>, Matrix<T>)> {
    let forces = constraint_matrix(m, efficiency);
    let map = complete(&forces, &c.independent, &c.dependent)?;
    Some((map, forces))
}

/// Rows of all constraints over the nodes; `efficiency(constraint, index)` scales the entries
/// other than the first of lossy ones.
fn constraint_matrix<T: Real>(
    m: &Mechanism<T>,
    efficiency: impl Fn(&Constraint<T>, usize) -> Option<T>,
) -> Matrix<T> {
    let mut c = Matrix::zeros(m.constraints.len(), m.nodes.len());
    for (i, constraint) in m.constraints.iter().enumerate() {
        let eta = efficiency(constraint, i).unwrap_or(T::of(1.0));
        for (position, &(node, coefficient)) in constraint.row.iter().enumerate() {
            c[(i, node)] += if position == 0 { coefficient } else { coefficient * eta };
        }
    }
    c
}

/// `[I; -C_dep⁻¹ C_ind]` in node order, or `None` if the dependent block is singular.
fn complete<T: Real>(
    c: &Matrix<T>,
    independent: &[usize],
    dependent: &[usize],
) -> Option<Matrix<T>> {
    let tied = solve(c.select_columns(dependent), c.select_columns(independent)).ok()?;
    let mut map = Matrix::zeros(c.cols, independent.len());
    for (j, &node) in independent.iter().enumerate() {
        map[(node, j)] = T::of(1.0);
    }
    for (i, &node) in dependent.iter().enumerate() {
        for j in 0..independent.len() {
            map[(node, j)] = -tied[(i, j)];
        }
    }
    Some(map)
}

/// One dependent node per independent constraint, massless nodes first: coordinates are then mostly the
/// speeds of real masses.
fn dependent_nodes<T: Real>(m: &Mechanism<T>, c: &Matrix<T>) -> Vec<usize> {
    let massless = |node: usize| {
        !m.inertias.iter().any(|i| i.inertia.re() > 0.0 && i.row.len() == 1 && i.row[0].0 == node)
    };
    let (mut order, heavy): (Vec<usize>, Vec<usize>) =
        (0..m.nodes.len()).partition(|&i| massless(i));
    order.extend(heavy);
    independent_columns(c, &order)
}

/// Elements of a smallest set of dependent rows.
fn dependent_elements<T: Real>(m: &Mechanism<T>, c: &Matrix<T>) -> Vec<String> {
    let deficient = |rows: &[usize]| independent_rows(&c.select_rows(rows)).len() < rows.len();
    let mut rows: Vec<usize> = (0..c.rows).collect();
    let mut i = 0;
    while i < rows.len() {
        let mut without = rows.clone();
        without.remove(i);
        if deficient(&without) { rows = without } else { i += 1 }
    }
    rows.into_iter().map(|i| m.constraints[i].element.to_string()).collect()
}
