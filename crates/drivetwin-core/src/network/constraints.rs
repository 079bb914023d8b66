// SPDX-License-Identifier: MIT
//! Minimal coordinates: some node speeds are independent, the rest follow from the constraints.

use super::error::CompileError;
use super::linalg::{Matrix, eliminate, independent_rows};
use crate::model::mechanism::Mechanism;
use crate::number::{Number, Values};

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

/// Speeds and twists that members without mass follow.
#[derive(Clone, Debug)]
pub struct Followers<T> {
    /// Part of the node speeds beside the independent ones, nodes × basis without channels.
    pub speeds: Matrix<T>,
    /// Twists in balance, springs × (twists, 1), where a member has springs only.
    pub twists: Option<Matrix<T>>,
}

impl<T: Number> Coordinates<T> {
    /// Coordinates under `C ω = 0`; of the nodes the first in `order` are made dependent. `None` where rows of C
    /// depend on each other.
    pub fn under(mut c: Matrix<T>, order: &[usize]) -> Option<Self> {
        let dependent = eliminate(&mut c, order);
        let independent: Vec<usize> = (0..c.cols).filter(|i| !dependent.contains(i)).collect();
        let speeds = over_independent(&c, &independent, &dependent);
        (dependent.len() == c.rows).then_some(Self { independent, dependent, speeds })
    }
}

/// Choose coordinates for `C ω = 0`; faults name the elements.
pub fn coordinates<T: Number>(m: &Mechanism<T>) -> Result<Coordinates<T>, CompileError> {
    let found = Coordinates::under(constraint_matrix(m, |_| None), &massless_first(m));
    let dependent = || CompileError::DependentConstraints { elements: dependent_elements(m) };
    let found = found.ok_or_else(dependent)?;
    if found.independent.is_empty() {
        let elements = m.constraints.iter().map(|one| one.element.to_string()).collect();
        return Err(CompileError::Immobile { elements });
    }
    Ok(found)
}

/// The map from node torques to generalised forces, `Kᵀ f`, like N, but built from the force rows: the
/// constraints as their forces act on the nodes, see [`constraint_matrix`]. `None` where the efficiencies
/// make the force balance singular (self-locking).
pub fn force_map<T: Number>(
    mut force_rows: Matrix<T>,
    Coordinates { independent, dependent, .. }: &Coordinates<T>,
) -> Option<Matrix<T>> {
    let determined = eliminate(&mut force_rows, dependent).len() == dependent.len();
    determined.then(|| over_independent(&force_rows, independent, dependent))
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

/// `[I; -C_dep⁻¹ C_ind]` in node order, where `C_dep` has been brought to unity.
fn over_independent<T: Number>(
    c: &Matrix<T>,
    independent: &[usize],
    dependent: &[usize],
) -> Matrix<T> {
    let mut map = Matrix::zeros(c.cols, independent.len());
    for (j, &node) in independent.iter().enumerate() {
        map[(node, j)] = T::of(1.0);
        for (i, &tied) in dependent.iter().enumerate() {
            map[(tied, j)] = -c[(i, node)];
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
    let c = constraint_matrix(m, |_| None);
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
