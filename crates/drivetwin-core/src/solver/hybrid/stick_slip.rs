// SPDX-License-Identifier: MIT
//! Stick-slip decision (THEORY section 1): the box-constrained programme over all friction
//! elements at zero slip, together with the states of lossy gears.

use crate::network::linalg::{Matrix, independent_rows};
use crate::network::nonlinear_torque::form;
use crate::network::{Branch, GearState, Mode, ModeKey, RowId};
use crate::number::{Number, Values};
use crate::solver::hybrid::active_set::ActiveSet;
use crate::solver::hybrid::event::{FrictionState, signum_nonneg};
use crate::solver::hybrid::state::HybridState;
use crate::solver::status::Status;
use crate::solver::tolerances::{
    BOUND_RTOL, FORCED_ACCELERATION_RTOL, FORCED_SUM_RTOL, STRICT_MARGIN_RTOL, SUM_RTOL,
    TORQUE_ATOL, ZERO_SLIP_RTOL, negligible, sum_and_scale,
};
use std::sync::Arc;

/// Most trials before every assignment is tried in turn.
const MAX_TRIALS: usize = 200;
/// Most rows at zero speed for which every assignment is tried.
const MAX_EXHAUSTIVE: usize = 8;

/// Violated condition of an active set.
enum Violation {
    /// A row at rest carries more than its bounds allow; the torque's sign.
    TorqueBound(RowId, f64),
    /// A row that moves off from zero speed accelerates back.
    SlipDirection(RowId),
    /// Power through a rolling gear flows the other way.
    PowerDirection(usize),
}

impl<T: Number> HybridState<'_, T> {
    /// Decide anew the state of everything at zero speed. `overloaded` names what has just reached
    /// its bound, with the torque's sign.
    pub(crate) fn decide(&mut self, overloaded: Option<(RowId, f64)>) -> Result<(), Status> {
        self.evaluate_at_t_plus()?;
        let candidates = self.list_at_zero_speed();
        self.check_forced(&candidates)?;
        let mut trial = self.assignment();
        match overloaded {
            // After an overload, rows that have just moved off or are at their capacity keep that state.
            Some((row, sign)) if !self.is_blocked(row, sign) => {
                self.release(&mut trial, row, sign, &candidates);
            }
            _ => candidates.iter().for_each(|&row| trial.rest(row)),
        }
        let mut visited: Vec<ActiveSet> = Vec::new();
        loop {
            let mode = self.mode(self.key_of(&trial))?;
            let basis = self.basis_now(&trial, &candidates, &mode)?;
            let Some(fault) = self.fault(&trial, &candidates, &mode, &basis) else {
                let moving = trial.moving_off(&candidates).0;
                if moving == 0
                    || self.rank(&candidates) == candidates.len()
                    || !self.enumerate_active_sets(&candidates, Some(moving))
                {
                    let after = overloaded.is_some();
                    let (trial, mode) =
                        self.restick_if_feasible(trial, mode, basis, &candidates, after);
                    self.adopt(trial, &candidates, mode)?;
                }
                return Ok(());
            };
            let blocked =
                matches!(fault, Violation::TorqueBound(row, sign) if self.is_blocked(row, sign));
            if blocked || visited.contains(&trial) || visited.len() > MAX_TRIALS {
                if self.enumerate_active_sets(&candidates, None) {
                    return Ok(());
                }
                let element = candidates.first();
                let element = element.map_or("a gear", |&row| self.network.element_of(row));
                let element = element.to_owned();
                return Err(Status::Undecidable { time: self.time(), element });
            }
            visited.push(trial.clone());
            match fault {
                Violation::TorqueBound(row, sign) => {
                    self.release(&mut trial, row, sign, &candidates);
                }
                Violation::SlipDirection(row) => {
                    trial.rest(row);
                    self.classify_saturated(&mut trial, &candidates);
                }
                Violation::PowerDirection(i) => trial.reverse_power(i),
            }
        }
    }

    /// Try every assignment of the candidates in a fixed order, those first in which fewer friction elements
    /// move off: what can hold holds. Adopts the first without fault, if there is one.
    ///
    /// Torques that have been taken to their bounds one by one need not be those with which everything
    /// holds: with `moving`, only lasting assignments count in which fewer than so many friction elements
    /// move off, and in which all that move off have overcome their static capacities.
    fn enumerate_active_sets(&mut self, candidates: &[RowId], moving: Option<usize>) -> bool {
        let gears = self.gears.len();
        let choices = 3usize.pow(candidates.len().min(MAX_EXHAUSTIVE) as u32) << gears.min(4);
        let feasible = candidates.len() <= MAX_EXHAUSTIVE && gears <= 4;
        let mut all: Vec<usize> = (0..if feasible { choices } else { 0 }).collect();
        all.sort_by_cached_key(|&choice| {
            self.choice(choice, candidates).map(|trial| trial.moving_off(candidates))
        });
        for choice in all {
            let Some(trial) = self.choice(choice, candidates) else { continue };
            if moving.is_some_and(|most| trial.moving_off(candidates).0 >= most) {
                break;
            }
            let Ok(mode) = self.mode(self.key_of(&trial)) else { continue };
            let Ok(basis) = self.basis_now(&trial, candidates, &mode) else { continue };
            let is_right = self.fault(&trial, candidates, &mode, &basis).is_none()
                && (moving.is_none()
                    || self.is_strictly_feasible(&mode, &basis)
                        && self.violates_static_limit(&trial, candidates, &mode));
            if is_right {
                return self.adopt(trial, candidates, mode).is_ok();
            }
        }
        false
    }

    /// Return friction elements that move off without acceleration to rest, where that is feasible too: at
    /// exactly its capacity an element holds. After an overload only those that rested before it, and with
    /// something else that moves off in their place.
    fn restick_if_feasible(
        &mut self,
        mut trial: ActiveSet,
        mut mode: Arc<Mode<T>>,
        basis: Vec<T>,
        candidates: &[RowId],
        overloaded: bool,
    ) -> (ActiveSet, Arc<Mode<T>>) {
        let before = self.assignment();
        let moves = |assignment: &ActiveSet, row| assignment.direction(row).is_some();
        let frictions = candidates.iter().copied().filter(|row| matches!(row, RowId::Friction(_)));
        let moving: Vec<RowId> = frictions
            .filter(|&row| moves(&trial, row) && !(overloaded && moves(&before, row)))
            .collect();
        if overloaded && moving.len() < 2 {
            return (trial, mode);
        }
        for row in moving {
            let mut held = trial.clone();
            held.rest(row);
            self.classify_saturated(&mut held, candidates);
            let same = |&row: &RowId| held.direction(row) == before.direction(row);
            if overloaded && candidates.iter().all(same) || !self.stays(row, &mode, &basis) {
                continue;
            }
            let Ok(mode_held) = self.mode(self.key_of(&held)) else { continue };
            let Ok(basis_held) = self.basis_now(&held, candidates, &mode_held) else { continue };
            if self.fault(&held, candidates, &mode_held, &basis_held).is_none() {
                (trial, mode) = (held, mode_held);
            }
        }
        (trial, mode)
    }

    /// Return true if every slipping candidate also slips against its static capacity.
    fn violates_static_limit(
        &mut self,
        trial: &ActiveSet,
        candidates: &[RowId],
        mode: &Mode<T>,
    ) -> bool {
        let mut at_capacity = trial.clone();
        for &row in candidates {
            if let (RowId::Friction(j), Some(sign)) = (row, trial.direction(row)) {
                at_capacity.rows[j] = FrictionState::Saturated { sign };
            }
        }
        let basis = self.basis_now(&at_capacity, candidates, mode);
        basis.is_ok_and(|basis| self.returning(trial, candidates, mode, &basis).is_none())
    }

    /// Return true if every holding torque lies strictly within its bounds.
    fn is_strictly_feasible(&self, mode: &Mode<T>, basis: &[T]) -> bool {
        let capacities = self.capacities();
        mode.stuck.iter().enumerate().all(|(i, &row)| {
            let torque = form(mode.stuck_torque.row(i), basis).re();
            let (low, high) = self.bounds(row, &capacities, mode, basis);
            let room = (torque - low).smaller(high - torque);
            room.decide_with(torque, |room, torque| room > STRICT_MARGIN_RTOL * torque.abs())
        })
    }

    /// An assignment by its number: whether power flows back through every lossy gear, and whether every
    /// candidate rests, moves off forwards or backwards. Nothing where one cannot.
    fn choice(&self, number: usize, candidates: &[RowId]) -> Option<ActiveSet> {
        let (mut trial, gears) = (self.assignment(), self.gears.len());
        let mut digits = number >> gears;
        for &row in candidates {
            match digits % 3 {
                1 if self.network.is_one_way(row) => return None,
                0 => trial.rest(row),
                1 => trial.move_off(row, 1.0),
                _ => trial.move_off(row, -1.0),
            }
            digits /= 3;
        }
        (0..gears).filter(|i| number >> i & 1 == 1).for_each(|i| trial.reverse_power(i));
        self.classify_saturated(&mut trial, candidates);
        Some(trial)
    }

    pub(super) fn assignment(&self) -> ActiveSet {
        ActiveSet { rows: self.rows.clone(), gears: self.gears.clone() }
    }

    pub(super) fn list_at_zero_speed(&self) -> Vec<RowId> {
        let near = |row: RowId| {
            let slip = self.network.slip_of(row);
            let terms = slip.iter().zip(&self.x);
            let terms = terms.map(|(c, v)| (c.re() * v.re()).magnitude());
            let scale = terms.fold(T::Values::of(1.0), |largest, term| term.larger(largest));
            form(slip, &self.x)
                .re()
                .decide_with(scale, |slip, scale| slip.abs() <= ZERO_SLIP_RTOL * scale)
        };
        let pressed = |j: &usize| self.rows[*j] != FrictionState::Open;
        let directional = |i: &usize| self.network.losses[*i].loss.is_directional();
        let frictions = (0..self.rows.len()).filter(pressed).map(RowId::Friction);
        let gears = (0..self.gears.len()).filter(directional).map(RowId::Gear);
        frictions.chain(gears).filter(|&row| near(row)).collect()
    }

    fn key_of(&self, trial: &ActiveSet) -> ModeKey {
        let stuck = (0..trial.rows.len()).filter(|&j| trial.rows[j] == FrictionState::Sticking);
        ModeKey::new(stuck, &trial.gears)
    }

    fn fault(
        &self,
        trial: &ActiveSet,
        candidates: &[RowId],
        mode: &Mode<T>,
        basis: &[T],
    ) -> Option<Violation> {
        self.find_overload(mode, basis)
            .or_else(|| {
                self.returning(trial, candidates, mode, basis).map(Violation::SlipDirection)
            })
            .or_else(|| {
                let reversed = |&i: &usize| self.is_reversed(trial.gears[i], i, mode, basis);
                (0..trial.gears.len()).find(reversed).map(Violation::PowerDirection)
            })
    }

    /// A row that moves off from zero speed and accelerates back.
    fn returning(
        &self,
        trial: &ActiveSet,
        candidates: &[RowId],
        mode: &Mode<T>,
        basis: &[T],
    ) -> Option<RowId> {
        let returns = |&row: &RowId| {
            trial.direction(row).is_some_and(|sign| {
                let (a, scale) = self.acceleration(row, mode, basis);
                (a * sign).decide_with(scale, |a, scale| a < -negligible(scale))
            })
        };
        candidates.iter().copied().find(returns)
    }

    /// Return true if the acceleration of a row is round-off.
    fn stays(&self, row: RowId, mode: &Mode<T>, basis: &[T]) -> bool {
        let (a, scale) = self.acceleration(row, mode, basis);
        a.decide_with(scale, |a, scale| a.abs() <= negligible(scale))
    }

    /// The row at rest that exceeds its bounds most, relative to their size.
    fn find_overload(&self, mode: &Mode<T>, basis: &[T]) -> Option<Violation> {
        let capacities = self.capacities();
        let rows = || (0..mode.stuck.len()).map(|i| mode.stuck_torque.row(i));
        let sizes = rows().map(|row| sum_and_scale(row, basis).1);
        let nothing = sizes.fold(T::Values::zero_(), |sum, size| sum + size) * BOUND_RTOL;
        let mut worst: Option<(T::Values, Violation)> = None;
        for (&row, terms) in mode.stuck.iter().zip(rows()) {
            let torque = form(terms, basis).re();
            let (low, high) = self.bounds(row, &capacities, mode, basis);
            let above = torque.decide_with(high, |torque, high| torque > high);
            let (excess, size, sign) = if above {
                (torque - high, high.magnitude(), 1.0)
            } else {
                (low - torque, low.magnitude(), -1.0)
            };
            let size = size.larger(torque.magnitude() * 1e-9).larger(T::Values::of(1e-12));
            let relative = excess / size;
            let least = worst.as_ref().map_or(T::Values::of(1e-12), |worst| worst.0);
            let counts = excess.decide_with(nothing, |excess, nothing| excess > nothing);
            if counts && relative.decide_with(least, |relative, least| relative > least.max(1e-12))
            {
                worst = Some((relative, Violation::TorqueBound(row, sign)));
            }
            if worst.is_none() && !self.network.prescribed.is_empty() {
                let (a, scale) = self.acceleration(row, mode, basis);
                let forced = self.forced_acceleration().larger(scale * FORCED_SUM_RTOL);
                if a.decide_with(forced, |a, forced| a.abs() > forced) {
                    worst =
                        Some((T::Values::zero_(), Violation::TorqueBound(row, signum_nonneg(a))));
                }
            }
        }
        worst.map(|(_, fault)| fault)
    }

    /// Bounds of the torque of a row at rest.
    fn bounds(
        &self,
        row: RowId,
        capacities: &[T],
        mode: &Mode<T>,
        basis: &[T],
    ) -> (T::Values, T::Values) {
        match row {
            RowId::Friction(j) if self.network.frictions[j].one_way => {
                (-capacities[j].re() - T::Values::of(TORQUE_ATOL), T::Values::of(f64::INFINITY))
            }
            RowId::Friction(j) => (-capacities[j].re(), capacities[j].re()),
            RowId::Gear(g) => {
                self.gear_bounds(g, form(mode.gear_torque(self.network).row(g), basis).re())
            }
        }
    }

    /// Acceleration of a row at rest that is round-off, rad/s². Prescribed speeds force larger
    /// values.
    fn forced_acceleration(&self) -> T::Values {
        let rates =
            self.network.prescribed.iter().map(|&(_, input)| self.inputs_plus[input][1].re());
        let one = T::Values::of(1.0);
        (rates.fold(T::Values::zero_(), |largest, r| r.magnitude().larger(largest)) + one)
            * FORCED_ACCELERATION_RTOL
    }

    fn gear_bounds(&self, g: usize, torque: T::Values) -> (T::Values, T::Values) {
        let bounds = self.network.losses[g].loss.bounds();
        let line = |(slope, drag): (T, T)| slope.re() * torque + drag.re();
        let [u, v] = bounds.upper.map(line);
        let [l, m] = bounds.lower.map(line);
        let more = T::Values::of(TORQUE_ATOL);
        (l.smaller(m) - more, u.larger(v) + more)
    }

    fn is_reversed(&self, gear: GearState, i: usize, mode: &Mode<T>, basis: &[T]) -> bool {
        let GearState::Meshing { sign, power_reversed } = gear else { return false };
        let loss = &self.network.losses[i].loss;
        if !loss.is_directional() {
            return false;
        }
        let (torque, scale) = sum_and_scale(mode.gear_torque(self.network).row(i), basis);
        // Torques that elements at rest balance leave round-off behind, but no term of this sum.
        let held = (0..mode.stuck.len()).map(|i| form(mode.stuck_torque.row(i), basis).re());
        let scale = held.fold(scale, |scale, torque| scale + torque.magnitude());
        let excess = torque * sign - loss.threshold().re();
        excess.decide_with(scale, |excess, scale| {
            excess.abs() > SUM_RTOL * scale + TORQUE_ATOL && (excess < 0.0) != power_reversed
        })
    }

    /// Acceleration [rad/s²] of a row's speed and the size of the terms it is the sum of.
    pub(super) fn acceleration(
        &self,
        row: RowId,
        mode: &Mode<T>,
        basis: &[T],
    ) -> (T::Values, T::Values) {
        let (mut sum, mut scale) = (T::Values::zero_(), T::Values::zero_());
        for (i, c) in self.network.slip_of(row).iter().enumerate() {
            let (part, size) = sum_and_scale(mode.derivative.row(i), basis);
            sum += c.re() * part;
            scale += c.re().magnitude() * size;
        }
        (sum, scale)
    }

    /// An overloaded row moves off, or stays at its capacity where others hold its speed.
    fn release(&self, trial: &mut ActiveSet, row: RowId, sign: f64, candidates: &[RowId]) {
        trial.move_off(row, sign);
        self.classify_saturated(trial, candidates);
    }

    /// Of the friction elements at zero speed that carry all they can, those slip that nothing at rest
    /// holds; the others stay at their capacity.
    fn classify_saturated(&self, trial: &mut ActiveSet, candidates: &[RowId]) {
        use FrictionState::{Saturated, Slipping};
        for &row in candidates {
            if let RowId::Friction(j) = row
                && let Slipping { sign } | Saturated { sign } = trial.rows[j]
            {
                let held = self.is_held_by_others(trial, row);
                trial.rows[j] = if held { Saturated { sign } } else { Slipping { sign } };
            }
        }
    }

    /// Return true if the elements at rest hold the speed of a row that is not at rest.
    fn is_held_by_others(&self, trial: &ActiveSet, row: RowId) -> bool {
        let mut stuck = self.key_of(trial).rows();
        let alone = self.rank(&stuck);
        stuck.push(row);
        self.rank(&stuck) == alone
    }

    /// Number of independent speeds of rows.
    fn rank(&self, rows: &[RowId]) -> usize {
        let mut speeds = Matrix::zeros(rows.len(), self.network.speeds());
        let mut sizes = Vec::with_capacity(rows.len());
        for (i, &row) in rows.iter().enumerate() {
            let slip = self.network.slip_of(row);
            speeds.row_mut(i).copy_from_slice(slip);
            sizes.push(slip.size);
        }
        independent_rows(&speeds, &sizes).len()
    }

    /// Make a trial the state of the run.
    fn adopt(
        &mut self,
        trial: ActiveSet,
        candidates: &[RowId],
        mode: Arc<Mode<T>>,
    ) -> Result<(), Status> {
        if !self.network.table_losses.is_empty() {
            self.basis_now(&trial, candidates, &mode)?;
        }
        self.released.iter_mut().for_each(|r| *r = false);
        for &row in candidates {
            let index = self.index_of(row);
            self.released[index] = trial.direction(row).is_some();
        }
        for i in 0..trial.gears.len() {
            let rolling = matches!(trial.gears[i], GearState::Meshing { .. });
            let watched = rolling && self.network.losses[i].loss.is_directional();
            self.blocked[i] = watched && self.is_held_by_others(&trial, RowId::Gear(i));
        }
        self.record_changes(&trial);
        self.rows = trial.rows;
        self.gears = trial.gears;
        for (j, row) in self.network.frictions.iter().enumerate() {
            self.branches[j] = match self.rows[j] {
                FrictionState::Open | FrictionState::Sticking => Branch::Off,
                _ if !self.pressed[j] => Branch::Off,
                FrictionState::Saturated { sign } => Branch::Saturated { sign },
                FrictionState::Slipping { sign } => {
                    let (slip, none) = (form(&row.slip, &self.x).re(), T::Values::zero_());
                    let inputs = &self.expansion.inputs;
                    self.network.channels[j].branch_at([slip, none], sign, inputs)
                }
            };
        }
        self.mode = mode;
        Ok(())
    }
}
