// SPDX-License-Identifier: MIT
//! Who stays stuck (THEORY section 1): the box-constrained programme over all friction elements at
//! zero slip, together with the direction of power through lossy gears.

use super::integrator::{Integrator, RowState};
use super::status::Status;
use crate::network::channel::{Cell, apply, form};
use crate::network::linalg::{Matrix, independent_rows};
use crate::network::{Mode, ModeKey};
use crate::number::Real;
use std::sync::Arc;

/// A trial assignment: the state of every friction element and the direction of every lossy gear.
type Assignment = (Vec<RowState>, u32);

/// What counts as zero in a sum, relative to the size of its terms.
const ROUND_OFF: f64 = 1e-10;

/// What is wrong with an assignment.
#[derive(Debug)]
enum Fault {
    /// A stuck element carries more than its static capacity; the torque's sign.
    Overloaded(usize, f64),
    /// A slipping element at zero slip accelerates against its friction torque.
    Returning(usize),
    /// Power through a lossy gear flows the other way.
    Reversed(usize),
}

impl<T: Real> Integrator<'_, T> {
    /// Decide anew the state of all friction elements at zero slip. `overloaded` names the one whose
    /// holding torque has just reached its capacity, with the torque's sign.
    pub(super) fn decide(&mut self, overloaded: Option<(usize, f64)>) -> Result<(), Status> {
        let candidates = self.at_zero_slip();
        let mut rows = self.rows.clone();
        for &j in &candidates {
            // An overload asks for more: what is at its capacity already stays there.
            if overloaded.is_none() || !matches!(rows[j], RowState::Saturated { .. }) {
                rows[j] = RowState::Stuck;
            }
        }
        if let Some((j, sign)) = overloaded {
            self.give_way(&mut rows, j, sign);
        }
        let mut visited: Vec<Assignment> = Vec::new();
        loop {
            let key = self.key_of(&rows);
            let mode = self.mode(key)?;
            let basis = self.basis_at(&rows, &candidates);
            let Some(fault) = self.fault(&rows, &candidates, (&mode, &basis)) else {
                self.adopt(rows, &candidates, mode);
                return Ok(());
            };
            let assignment = (rows.clone(), self.backward);
            if visited.contains(&assignment) || visited.len() > 200 {
                return self.decide_exhaustively(&candidates);
            }
            visited.push(assignment);
            match fault {
                Fault::Overloaded(j, sign) => self.give_way(&mut rows, j, sign),
                Fault::Returning(j) => rows[j] = RowState::Stuck,
                Fault::Reversed(i) => self.backward ^= 1 << i,
            }
        }
    }

    /// Try every assignment of the candidates in a fixed order; the first without fault holds.
    fn decide_exhaustively(&mut self, candidates: &[usize]) -> Result<(), Status> {
        let gears = self.network.losses.len() as u32;
        let element = || {
            candidates
                .first()
                .map_or_else(String::new, |&j| self.network.frictions[j].element.clone())
        };
        let undecidable = Status::Undecidable { time: self.t.re(), element: element() };
        if candidates.len() > 7 || gears > 4 {
            return Err(undecidable);
        }
        for trial in 0..3usize.pow(candidates.len() as u32) << gears {
            self.backward = (trial & ((1 << gears) - 1)) as u32;
            let mut rows = self.rows.clone();
            let mut digits = trial >> gears;
            for &j in candidates {
                rows[j] = match digits % 3 {
                    0 => RowState::Stuck,
                    1 => RowState::Slipping { sign: 1.0 },
                    _ => RowState::Slipping { sign: -1.0 },
                };
                digits /= 3;
            }
            let mode = self.mode(self.key_of(&rows))?;
            let basis = self.basis_at(&rows, candidates);
            if self.fault(&rows, candidates, (&mode, &basis)).is_none() {
                self.adopt(rows, candidates, mode);
                return Ok(());
            }
        }
        Err(undecidable)
    }

    fn at_zero_slip(&self) -> Vec<usize> {
        let near = |j: usize| {
            let row = &self.network.frictions[j];
            let terms = row.slip.iter().zip(&self.x);
            let scale = terms.map(|(c, v)| (c.re() * v.re()).abs()).fold(0.0, f64::max);
            form(&row.slip, &self.x).re().abs() <= 1e-11 * scale.max(1.0)
        };
        let pressed = |j: usize| self.rows[j] != RowState::Open;
        (0..self.rows.len()).filter(|&j| pressed(j) && near(j)).collect()
    }

    pub(super) fn key_of(&self, rows: &[RowState]) -> ModeKey {
        let mut key = ModeKey { stuck: 0, backward: self.backward };
        for (j, &row) in rows.iter().enumerate() {
            key = key.with_stuck(j, row == RowState::Stuck);
        }
        key
    }

    /// The basis (x, u, 1, φ) at this instant.
    fn basis_at(&self, rows: &[RowState], candidates: &[usize]) -> Vec<T> {
        let network = self.network;
        let mut basis = vec![T::zero_(); network.basis()];
        basis[..self.x.len()].copy_from_slice(&self.x);
        for (i, input) in self.expansion.inputs.iter().enumerate() {
            basis[network.first_input() + i] = input[0];
        }
        basis[network.one()] = T::of(1.0);
        for (j, row) in network.frictions.iter().enumerate() {
            let slip = if candidates.contains(&j) { T::zero_() } else { form(&row.slip, &self.x) };
            let normal = row.normal.line(&self.expansion.inputs)[0];
            basis[network.first_channel() + row.channel] = match rows[j] {
                RowState::Slipping { sign } => row.law.at(slip * sign) * normal * sign,
                RowState::Saturated { sign } => row.law.at(T::zero_()) * row.peak * normal * sign,
                RowState::Stuck | RowState::Open => T::zero_(),
            };
        }
        for i in network.frictions.len()..network.channels.len() {
            basis[network.first_channel() + i] = self.channel_now(i);
        }
        basis
    }

    fn static_capacity(&self, j: usize) -> T {
        let row = &self.network.frictions[j];
        let normal = row.normal.line(&self.expansion.inputs)[0];
        let capacity = row.law.at(T::zero_()) * row.peak * normal;
        if capacity.re() > 0.0 { capacity } else { T::zero_() }
    }

    pub(super) fn capacities(&self) -> Vec<T> {
        (0..self.rows.len()).map(|j| self.static_capacity(j)).collect()
    }

    fn fault(
        &self,
        rows: &[RowState],
        candidates: &[usize],
        (mode, basis): (&Mode<T>, &[T]),
    ) -> Option<Fault> {
        let mut worst: Option<(f64, Fault)> = None;
        for (i, &j) in mode.stuck.iter().enumerate() {
            let torque = apply(&mode.stuck_torque, i, basis).re();
            let capacity = self.static_capacity(j).re();
            let excess = (torque.abs() - capacity) / capacity.max(1e-9 * torque.abs()).max(1e-12);
            if excess > 1e-12 && worst.as_ref().is_none_or(|w| excess > w.0) {
                worst = Some((excess, Fault::Overloaded(j, torque.signum())));
            }
        }
        if let Some((_, fault)) = worst {
            return Some(fault);
        }
        for &j in candidates {
            if let RowState::Slipping { sign } = rows[j] {
                let (a, scale) = self.slip_acceleration(j, mode, basis);
                if a * sign < -ROUND_OFF * scale {
                    return Some(Fault::Returning(j));
                }
            }
        }
        for i in 0..self.network.losses.len() {
            if self.network.is_directional(i) {
                let (torque, scale) = sum_and_scale(mode.gear_torque.row(i), basis);
                let power = torque * self.gear_speed_sign[i];
                let backward = self.backward >> i & 1 == 1;
                if torque.abs() > ROUND_OFF * scale && (power < 0.0) != backward {
                    return Some(Fault::Reversed(i));
                }
            }
        }
        None
    }

    /// Slip acceleration [rad/s²] and the size of the terms it is the sum of.
    fn slip_acceleration(&self, j: usize, mode: &Mode<T>, basis: &[T]) -> (f64, f64) {
        let (mut sum, mut scale) = (0.0, 0.0);
        for (i, c) in self.network.frictions[j].slip.iter().enumerate() {
            let (part, size) = sum_and_scale(mode.derivative.row(i), basis);
            sum += c.re() * part;
            scale += c.re().abs() * size;
        }
        (sum, scale)
    }

    /// An overloaded element slips, unless others hold the same speed: then it stays at its
    /// capacity and they carry the rest. Elements at their capacity slip with the last that held.
    fn give_way(&self, rows: &mut [RowState], j: usize, sign: f64) {
        rows[j] = RowState::Saturated { sign };
        for i in 0..rows.len() {
            if let RowState::Saturated { sign } = rows[i]
                && !self.held_by_others(rows, i)
            {
                rows[i] = RowState::Slipping { sign };
            }
        }
    }

    /// Whether the stuck elements alone keep element `j` from slipping.
    fn held_by_others(&self, rows: &[RowState], j: usize) -> bool {
        let mut stuck: Vec<usize> = self.key_of(rows).stuck_rows().collect();
        let rank = |index: &[usize]| {
            let mut slips = Matrix::zeros(index.len(), self.network.speeds());
            for (i, &k) in index.iter().enumerate() {
                slips.row_mut(i).copy_from_slice(&self.network.frictions[k].slip);
            }
            independent_rows(&slips).len()
        };
        let alone = rank(&stuck);
        stuck.push(j);
        rank(&stuck) == alone
    }

    /// Make an assignment the state of the run.
    fn adopt(&mut self, rows: Vec<RowState>, candidates: &[usize], mode: Arc<Mode<T>>) {
        self.released.iter_mut().for_each(|r| *r = false);
        for &j in candidates {
            self.released[j] = matches!(rows[j], RowState::Slipping { .. });
        }
        self.record_changes(&rows);
        self.rows = rows;
        for (j, row) in self.network.frictions.iter().enumerate() {
            self.cells[row.channel] = match self.rows[j] {
                RowState::Open | RowState::Stuck => Cell::Off,
                RowState::Saturated { sign } => Cell::Saturated { sign },
                RowState::Slipping { sign } => {
                    let slip = form(&row.slip, &self.x).re();
                    self.network.channels[row.channel].cell_at(slip, sign, &self.expansion.inputs)
                }
            };
        }
        self.mode = mode;
    }
}

/// Real part of the scalar product and of the sum of the magnitudes of its terms, which tells
/// zero from round-off.
fn sum_and_scale<T: Real>(row: &[T], basis: &[T]) -> (f64, f64) {
    row.iter().zip(basis).fold((0.0, 0.0), |(sum, scale), (a, b)| {
        let term = a.re() * b.re();
        (sum + term, scale + term.abs())
    })
}
