// SPDX-License-Identifier: MIT
//! A mechanism with some of its friction elements engaged: which members move together, how many
//! speeds are left, and the speed of every member over those of a few named ones.

use super::linalg::{Matrix, independent_rows, solve};
use crate::model::Name;
use crate::model::mechanism::{Mechanism, Row};
use crate::number::Real;
use thiserror::Error;

/// Reason why the speeds of members do not follow from those of the named ones.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum EngagedError {
    /// A friction element that the mechanism does not have.
    #[error("there is no shift element {name:?}; it has {}", known.join(", "))]
    UnknownElement {
        /// Name asked for.
        name: String,
        /// Names there are.
        known: Vec<String>,
    },
    /// A member that the mechanism does not have.
    #[error("there is no member {name:?}; it has {}", known.join(", "))]
    UnknownMember {
        /// Name asked for.
        name: String,
        /// Names there are.
        known: Vec<String>,
    },
    /// Engaged elements and gears that repeat or contradict each other.
    #[error(
        "more is engaged than there are speeds to hold: {} depend on each other",
        elements.join(", ")
    )]
    Dependent {
        /// A smallest set of dependent elements.
        elements: Vec<String>,
    },
    /// Not the number of speeds that the question needs.
    #[error("{found} free speeds remain where {wanted} must; engaged: {}", engaged.join(", "))]
    FreeSpeeds {
        /// Speeds that remain.
        found: usize,
        /// Speeds that were to remain.
        wanted: usize,
        /// Engaged friction elements.
        engaged: Vec<String>,
    },
    /// A member whose speed must be free is held, or follows from the others.
    #[error("the speed of {} is not free; engaged: {}", members.join(" and "), engaged.join(", "))]
    NotFree {
        /// The members whose speeds were to be free.
        members: Vec<String>,
        /// Engaged friction elements.
        engaged: Vec<String>,
    },
}

/// One rigid row: the element that states it and its linear form over the nodes.
#[derive(Clone, Debug)]
pub struct RigidRow<T> {
    /// Gear, set or engaged friction element.
    pub element: String,
    /// `row · ω = 0`.
    pub row: Row<T>,
}

/// Speeds of a mechanism with engaged elements over those of its free members.
#[derive(Clone, Debug)]
pub struct EngagedMechanism<T> {
    /// Rigid rows that touch the moving part.
    pub rows: Vec<RigidRow<T>>,
    /// Nodes connected with a free member; the others idle and have no speed of their own.
    pub connected: Vec<usize>,
    /// Speed of every node per speed of each free member, nodes × free; zero where a node idles.
    pub speeds: Matrix<T>,
}

/// Index of a friction element by name.
pub fn friction_index<T>(m: &Mechanism<T>, name: &str) -> Result<usize, EngagedError> {
    m.frictions.iter().position(|f| f.element == name).ok_or_else(|| EngagedError::UnknownElement {
        name: name.to_owned(),
        known: m.frictions.iter().map(|f| f.element.to_string()).collect(),
    })
}

/// Index of a member by name.
pub fn member_index<T>(m: &Mechanism<T>, name: &str) -> Result<usize, EngagedError> {
    m.nodes.iter().position(|n| n == name).ok_or_else(|| EngagedError::UnknownMember {
        name: name.to_owned(),
        known: m.nodes.iter().map(Name::to_string).collect(),
    })
}

impl<T: Real> EngagedMechanism<T> {
    /// Engage the named friction elements and express all speeds over those of the `free` members.
    pub fn new(m: &Mechanism<T>, engaged: &[String], free: &[usize]) -> Result<Self, EngagedError> {
        let mut rows: Vec<RigidRow<T>> = m
            .constraints
            .iter()
            .map(|c| RigidRow { element: c.element.to_string(), row: c.row.clone() })
            .collect();
        for name in engaged {
            let friction = &m.frictions[friction_index(m, name)?];
            rows.push(RigidRow { element: name.clone(), row: friction.row.clone() });
        }
        let connected = connected(m, &rows, free);
        rows.retain(|r| r.row.iter().any(|(node, _)| connected.contains(node)));
        let matrix = row_matrix(&rows, m.nodes.len());
        let rank = independent_rows(&matrix, &row_sizes(&rows)).len();
        if rank < rows.len() {
            return Err(EngagedError::Dependent { elements: dependent(&rows, &matrix) });
        }
        let found = connected.len() - rank;
        if found != free.len() {
            let (wanted, engaged) = (free.len(), engaged.to_vec());
            return Err(EngagedError::FreeSpeeds { found, wanted, engaged });
        }
        let Some(speeds) = in_free_coordinates(&matrix, &connected, free) else {
            let members = free.iter().map(|&i| m.nodes[i].to_string()).collect();
            return Err(EngagedError::NotFree { members, engaged: engaged.to_vec() });
        };
        Ok(Self { rows, connected, speeds })
    }

    /// A linear form over nodes, expressed over the free speeds.
    pub fn in_free_coordinates(&self, row: &Row<T>) -> Vec<T> {
        (0..self.speeds.cols)
            .map(|j| row.iter().fold(T::zero_(), |sum, &(i, c)| sum + c * self.speeds[(i, j)]))
            .collect()
    }
}

/// Nodes that rigid rows or shared inertia terms connect with one of `from`, in node order.
fn connected<T: Real>(m: &Mechanism<T>, rows: &[RigidRow<T>], from: &[usize]) -> Vec<usize> {
    let shared = m.inertias.iter().filter(|i| i.inertia.re() != 0.0).map(|i| &i.row);
    let links: Vec<&Row<T>> = rows.iter().map(|r| &r.row).chain(shared).collect();
    let mut reached = vec![false; m.nodes.len()];
    from.iter().for_each(|&i| reached[i] = true);
    let mut grows = true;
    while grows {
        grows = false;
        for link in &links {
            let touches = link.iter().any(|&(i, _)| reached[i]);
            if touches && !link.iter().all(|&(i, _)| reached[i]) {
                link.iter().for_each(|&(i, _)| reached[i] = true);
                grows = true;
            }
        }
    }
    (0..reached.len()).filter(|&i| reached[i]).collect()
}

fn row_matrix<T: Real>(rows: &[RigidRow<T>], nodes: usize) -> Matrix<T> {
    let mut matrix = Matrix::zeros(rows.len(), nodes);
    for (i, rigid) in rows.iter().enumerate() {
        for &(node, coefficient) in &rigid.row {
            matrix[(i, node)] += coefficient;
        }
    }
    matrix
}

/// Largest coefficient of every row.
fn row_sizes<T: Real>(rows: &[RigidRow<T>]) -> Vec<T> {
    let size = |rigid: &RigidRow<T>| {
        rigid.row.iter().fold(0.0, |size: f64, (_, c)| size.max(c.re().abs()))
    };
    rows.iter().map(|rigid| T::of(size(rigid))).collect()
}

/// Solve the rows for the connected nodes that are not free; `None` where these do not determine
/// them.
fn in_free_coordinates<T: Real>(
    c: &Matrix<T>,
    connected: &[usize],
    free: &[usize],
) -> Option<Matrix<T>> {
    let dependent: Vec<usize> =
        connected.iter().copied().filter(|node| !free.contains(node)).collect();
    let tied = solve(c.select_columns(&dependent), c.select_columns(free)).ok()?;
    let mut speeds = Matrix::zeros(c.cols, free.len());
    for (j, &node) in free.iter().enumerate() {
        speeds[(node, j)] = T::of(1.0);
    }
    for (i, &node) in dependent.iter().enumerate() {
        for j in 0..free.len() {
            speeds[(node, j)] = -tied[(i, j)];
        }
    }
    Some(speeds)
}

/// Elements of a smallest set of dependent rows.
fn dependent<T: Real>(rows: &[RigidRow<T>], matrix: &Matrix<T>) -> Vec<String> {
    let sizes = row_sizes(rows);
    let deficient = |kept: &[usize]| {
        let sizes: Vec<T> = kept.iter().map(|&i| sizes[i]).collect();
        independent_rows(&matrix.select_rows(kept), &sizes).len() < kept.len()
    };
    let mut kept: Vec<usize> = (0..rows.len()).collect();
    let mut i = 0;
    while i < kept.len() {
        let mut without = kept.clone();
        without.remove(i);
        if deficient(&without) { kept = without } else { i += 1 }
    }
    kept.into_iter().map(|i| rows[i].element.clone()).collect()
}
