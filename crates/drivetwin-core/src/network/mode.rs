// SPDX-License-Identifier: MIT
//! The linear system of one mode (THEORY section 1): accelerations with some friction elements
//! stuck, their torques, and the torques through lossy gears.

use super::compile::Network;
use super::constraints::force_map;
use super::linalg::{Matrix, independent_rows, least_norm, solve};
use crate::model::mechanism::LossLaw;
use crate::number::Real;

/// Which friction elements are stuck and through which lossy gears power flows backwards, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ModeKey {
    /// Bit j: friction element j is stuck.
    pub stuck: u32,
    /// Bit i: power flows from the driven to the driving side of lossy gear i.
    pub backward: u32,
}

impl ModeKey {
    /// Indices of the stuck elements, in order.
    pub fn stuck_rows(self) -> impl Iterator<Item = usize> {
        (0..u32::BITS as usize).filter(move |j| self.stuck >> j & 1 == 1)
    }

    /// The key with element `j` stuck or not.
    pub fn with_stuck(self, j: usize, stuck: bool) -> Self {
        let bit = 1 << j;
        Self { stuck: if stuck { self.stuck | bit } else { self.stuck & !bit }, ..self }
    }
}

/// Linear maps over the basis (x, u, 1, φ).
#[derive(Clone, Debug)]
pub struct Mode<T> {
    /// State derivatives, states × basis.
    pub derivative: Matrix<T>,
    /// Torques of the stuck elements in the order of `stuck`, stuck × basis.
    pub stuck_torque: Matrix<T>,
    /// The stuck elements.
    pub stuck: Vec<usize>,
    /// Torque entering each lossy gear at its driving side, losses × basis.
    pub gear_torque: Matrix<T>,
    /// Whether more elements are stuck than there are speeds to hold; the torque split then
    /// depends on the capacities.
    pub redundant: bool,
}

impl<T: Real> Network<T> {
    /// Compile one mode. `capacity[j]` weighs the torque split of redundant locks.
    /// `None` if the efficiencies leave the accelerations undetermined.
    pub fn mode(&self, key: ModeKey, capacity: &[T]) -> Option<Mode<T>> {
        let n = &self.coordinates.speeds;
        let efficiency = |_: &_, constraint: usize| self.efficiency(key, constraint);
        let (map, force_rows) = force_map(&self.mechanism, &self.coordinates, efficiency)?;
        let kt = map.transposed();
        let mass = kt.times(&self.inertia).times(n);
        let free = solve(&mass, &kt.times(&self.node_torques)).ok()?;

        let stuck: Vec<usize> = key.stuck_rows().collect();
        let mut slip = Matrix::zeros(stuck.len(), self.speeds());
        let mut nodes = Matrix::zeros(self.mechanism.nodes.len(), stuck.len());
        for (i, &j) in stuck.iter().enumerate() {
            slip.row_mut(i).copy_from_slice(&self.frictions[j].slip);
            for &(node, direction) in &self.frictions[j].nodes {
                nodes[(node, i)] += direction;
            }
        }
        let response = solve(&mass, &kt.times(&nodes)).ok()?;
        let (stuck_torque, redundant) =
            holding_torque(&slip.times(&response), &slip.times(&free), &stuck, capacity);
        let acceleration = difference(&free, &response.times(&stuck_torque));
        let torques = difference(&self.node_torques, &nodes.times(&stuck_torque));
        let residual = difference(&torques, &self.inertia.times(n).times(&acceleration));
        Some(Mode {
            derivative: self.with_twists(&acceleration),
            gear_torque: self.gear_torques(&force_rows, &residual)?,
            stuck_torque,
            stuck,
            redundant,
        })
    }

    fn efficiency(&self, key: ModeKey, constraint: usize) -> Option<T> {
        let i = self.losses.iter().position(|loss| loss.constraint == constraint)?;
        let loss = &self.losses[i];
        let backward = key.backward >> i & 1 == 1;
        Some(match loss.law {
            LossLaw::Dissipative if backward => loss.eta.recip(),
            LossLaw::Paper | LossLaw::Dissipative => loss.eta,
        })
    }

    fn with_twists(&self, acceleration: &Matrix<T>) -> Matrix<T> {
        let mut derivative = Matrix::zeros(self.states(), self.basis());
        for i in 0..self.speeds() {
            derivative.row_mut(i).copy_from_slice(acceleration.row(i));
        }
        for i in 0..self.twist_rates.rows {
            let rate = self.twist_rates.row(i);
            derivative.row_mut(self.speeds() + i)[..rate.len()].copy_from_slice(rate);
        }
        derivative
    }

    /// Multipliers of the lossy constraints from the balance of the dependent nodes,
    /// `D_depᵀ λ = (f - I ω')_dep`.
    fn gear_torques(&self, force_rows: &Matrix<T>, residual: &Matrix<T>) -> Option<Matrix<T>> {
        let dependent = &self.coordinates.dependent;
        let balance = force_rows.transposed().select_rows(dependent);
        let multipliers = solve(&balance, &residual.select_rows(dependent)).ok()?;
        let lossy: Vec<usize> = self.losses.iter().map(|loss| loss.constraint).collect();
        Some(multipliers.select_rows(&lossy))
    }
}

/// Solve `W τ = b` for the torques that hold the slips at zero. For redundant locks the torques are
/// those of least `Σ (τ_j / cap_j)²`.
fn holding_torque<T: Real>(
    w: &Matrix<T>,
    b: &Matrix<T>,
    stuck: &[usize],
    capacity: &[T],
) -> (Matrix<T>, bool) {
    if independent_rows(w).len() == w.rows {
        return (solve(w, b).expect("independent rows"), false);
    }
    let scale = |i: usize| capacity[stuck[i]] + f64::MIN_POSITIVE.sqrt();
    let mut scaled = w.clone();
    for r in 0..w.rows {
        for c in 0..w.cols {
            scaled[(r, c)] *= scale(c);
        }
    }
    let mut torque = least_norm(&scaled, b);
    for i in 0..torque.rows {
        torque.row_mut(i).iter_mut().for_each(|t| *t *= scale(i));
    }
    (torque, true)
}

fn difference<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    let mut out = a.clone();
    for i in 0..a.rows {
        for (o, &s) in out.row_mut(i).iter_mut().zip(b.row(i)) {
            *o -= s;
        }
    }
    out
}
