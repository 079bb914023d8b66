// SPDX-License-Identifier: MIT
//! Impulses that bring rows to rest and prescribed speeds to theirs without a one-way clutch overrunning.
//!
//! The speeds after the impulse are the nearest to those before, in the metric of the mass matrix, that
//! satisfy all conditions (Moreau's plastic impact). The impulses are the multipliers of this convex programme:
//! that of a one-way clutch pushes in its blocked direction only, and none pushes where its clutch overruns.

use super::compile::Network;
use super::constraint_forces::ConstraintSolver;
use super::linalg::{Matrix, independent_rows};
use super::mode::{ModeKey, Motion, RowId, subtract_held};
use super::nonlinear_torque::form;
use crate::number::{Number, Values};

/// Multiplier of a row in a dependence that is round-off, relative to the largest one.
const MULTIPLIER_RTOL: f64 = 1e-9;
/// Slip of a one-way clutch that is round-off, relative to its largest term and to 1 rad/s.
const OVERRUN_RTOL: f64 = 1e-11;
/// Slip after an impulse that is round-off, relative to the same.
const RESTING_RTOL: f64 = 1e-9;

/// Impulses of one instant.
#[derive(Clone, Debug)]
pub struct Impulse<T> {
    /// Rows that come to rest: those asked for, but friction elements that prescribed speeds move, then
    /// one-way clutches that block.
    pub rows: Vec<RowId>,
    /// Change of the independent speeds, speeds × 1.
    pub change: Matrix<T>,
    /// Impulses of the rows, then of prescribed speeds, N·m·s.
    pub impulses: Matrix<T>,
    /// Impulse that enters each lossy gear at its driving side, N·m·s.
    pub entering: Matrix<T>,
}

/// Reason why there is no impulse.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImpulseFault {
    /// The efficiencies or the inertias leave the speeds undetermined.
    Undetermined,
    /// A one-way clutch blocks what the named elements demand.
    Conflict {
        /// The one-way clutch.
        element: String,
        /// Prescribed speeds, locks and other one-way clutches against it.
        with: Vec<String>,
    },
}

/// Speeds before an impulse and what they are to become.
#[derive(Clone, Copy, Debug)]
pub struct Demand<'a, T> {
    /// Rows that are to rest.
    pub rows: &'a [RowId],
    /// Independent speeds before, rad/s.
    pub speeds: &'a [T],
    /// Speeds that are prescribed, rad/s.
    pub prescribed: &'a [T],
}

/// One-way clutches that push, with their impulses, and the speeds with these.
struct Pushing<T> {
    rows: Vec<(RowId, T)>,
    speeds: Vec<T>,
}

impl<T: Number> Network<T> {
    /// Impulse that meets a demand; it acts through lossy gears as torques do in the states of `key`.
    pub fn impulse(&self, key: ModeKey, demand: Demand<'_, T>) -> Result<Impulse<T>, ImpulseFault> {
        let motion = self.motion_of(key).ok_or(ImpulseFault::Undetermined)?;
        let all = (0..self.frictions.len()).map(RowId::Friction);
        let one_way: Vec<RowId> = all.filter(|&row| self.is_one_way(row)).collect();
        let mut rows = self.blocking(&motion, demand, &one_way, OVERRUN_RTOL)?;
        let excess = self.excess(&rows, demand.speeds, demand.prescribed);
        let change = self.hold(&motion, &rows).stop(&excess).ok_or(ImpulseFault::Undetermined)?;
        let after: Vec<T> = (0..self.speeds()).map(|i| demand.speeds[i] + change[(i, 0)]).collect();
        rows.retain(|&row| !self.slips(row, &after, RESTING_RTOL));
        let hold = self.hold(&motion, &rows);
        let impulses = hold.impulses(&change);
        let (_, nodes) = self.build_held_speeds(&rows);
        let mut residual = Matrix::zeros(self.inertia.rows, 1);
        residual.subtract(&self.inertia.times(&self.coordinates.speeds).times(&change));
        subtract_held(&mut residual, &nodes, &impulses);
        Ok(Impulse { entering: self.entering(key, &residual), rows, change, impulses })
    }

    /// Speeds of rows that are to rest, then what prescribed speeds are off theirs, rows × 1, rad/s.
    pub fn excess(&self, rows: &[RowId], speeds: &[T], prescribed: &[T]) -> Matrix<T> {
        let mut excess = Matrix::zeros(rows.len() + prescribed.len(), 1);
        for (i, &row) in rows.iter().enumerate() {
            excess[(i, 0)] = form(self.slip_of(row), speeds);
        }
        for (i, ((speed, _), &target)) in (rows.len()..).zip(self.prescribed.iter().zip(prescribed))
        {
            excess[(i, 0)] = form(speed, speeds) - target;
        }
        excess
    }

    /// Refuse prescribed accelerations [rad/s²] that one of the one-way clutches at rest blocks, whatever
    /// gives way; `rtol` is relative to the largest acceleration and 1 rad/s².
    pub fn check_forced(
        &self,
        one_way: &[RowId],
        prescribed: &[T],
        rtol: f64,
    ) -> Result<(), ImpulseFault> {
        let Some(motion) = self.motion_of(ModeKey::default()) else { return Ok(()) };
        let speeds = vec![T::zero_(); self.speeds()];
        let demand = Demand { rows: &[], speeds: &speeds, prescribed };
        self.blocking(&motion, demand, one_way, rtol).map(drop)
    }

    /// Elements that together hold the speed of a row: of the rows `among` and of the prescribed speeds those
    /// that the row is a combination of.
    fn holders_of(&self, row: RowId, among: &[RowId]) -> Vec<String> {
        let Some(motion) = self.motion_of(ModeKey::default()) else { return Vec::new() };
        let response = self.response(&self.hold(&motion, among), &self.hold(&motion, &[row]));
        response.map_or(Vec::new(), |(_, multipliers)| self.named(among, &multipliers))
    }

    /// The rows of a demand and those of the one-way clutches that block: the dual active-set method of Goldfarb and
    /// Idnani (1983), which takes in the most violated condition and releases those whose impulse would pull.
    fn blocking(
        &self,
        motion: &Motion<T>,
        demand: Demand<'_, T>,
        one_way: &[RowId],
        rtol: f64,
    ) -> Result<Vec<RowId>, ImpulseFault> {
        let mut rows = demand.rows.to_vec();
        if one_way.is_empty() {
            return Ok(rows);
        }
        let excess = self.excess(&rows, demand.speeds, demand.prescribed);
        let change = self.hold(motion, &rows).stop(&excess).ok_or(ImpulseFault::Undetermined)?;
        let speeds = demand.speeds[..self.speeds()].iter().enumerate();
        let mut pushing = Pushing {
            rows: Vec::new(),
            speeds: speeds.map(|(i, &v)| v + change[(i, 0)]).collect(),
        };
        let mut left = 4 * (one_way.len() + 1) * (one_way.len() + 1);
        while let Some(row) = self.most_overrun(one_way, &pushing, rtol) {
            if demand.rows.contains(&row) {
                let firm = one_way.iter().filter(|other| **other != row).copied();
                let firm: Vec<RowId> = firm.filter(|other| demand.rows.contains(other)).collect();
                let (element, with) =
                    (self.element_of(row).to_owned(), self.holders_of(row, &firm));
                return Err(ImpulseFault::Conflict { element, with });
            }
            self.push(motion, demand.rows, row, &mut pushing, &mut left)?;
        }
        rows.extend(pushing.rows.iter().map(|(row, _)| *row));
        Ok(rows)
    }

    /// The one-way clutch with the largest slip in its blocked direction.
    fn most_overrun(&self, one_way: &[RowId], pushing: &Pushing<T>, rtol: f64) -> Option<RowId> {
        let mut worst: Option<(T::Values, RowId)> = None;
        for &row in one_way.iter().filter(|row| pushing.rows.iter().all(|(p, _)| p != *row)) {
            let slip = form(self.slip_of(row), &pushing.speeds).re();
            let least = worst.map_or(T::Values::zero_(), |(slip, _)| slip);
            if self.slips(row, &pushing.speeds, rtol)
                && slip.decide_with(least, |slip, least| slip > least)
            {
                worst = Some((slip, row));
            }
        }
        worst.map(|(_, row)| row)
    }

    /// Return true if the slip of a row is no round-off, relative to its largest term and to 1 rad/s.
    fn slips(&self, row: RowId, speeds: &[T], rtol: f64) -> bool {
        let terms = self.slip_of(row).iter().zip(speeds);
        let terms = terms.map(|(c, v)| (c.re() * v.re()).magnitude());
        let scale = terms.fold(T::Values::of(1.0), |largest, term| term.larger(largest));
        let slip = form(self.slip_of(row), speeds).re();
        slip.decide_with(scale, |slip, scale| slip.abs() > rtol * scale)
    }

    /// Let a one-way clutch push until it no longer overruns; clutches whose impulse comes to nothing on
    /// the way are released. `left` counts down the steps of all.
    fn push(
        &self,
        motion: &Motion<T>,
        locked: &[RowId],
        row: RowId,
        pushing: &mut Pushing<T>,
        left: &mut usize,
    ) -> Result<(), ImpulseFault> {
        let own = self.hold(motion, &[row]);
        let mut impulse = T::zero_();
        loop {
            let rows: Vec<RowId> =
                locked.iter().copied().chain(pushing.rows.iter().map(|(row, _)| *row)).collect();
            let hold = self.hold(motion, &rows);
            let (response, multipliers) =
                self.response(&hold, &own).ok_or(ImpulseFault::Undetermined)?;
            let release = pushing.first_release(&multipliers, locked.len());
            let slip = form(self.slip_of(row), &pushing.speeds);
            let rate = -form(self.slip_of(row), &response);
            let full = is_independent(&hold, &own).then(|| slip / rate);
            *left = left.saturating_sub(1);
            let step = match (full, release) {
                (None, None) => None,
                _ if *left == 0 => None,
                (Some(full), Some((at, _))) if full.re().decide_with(at.re(), |a, b| a > b) => {
                    Some((at, release))
                }
                (Some(full), _) => Some((full, None)),
                (None, Some((at, _))) => Some((at, release)),
            };
            let Some((step, released)) = step else {
                let (element, with) =
                    (self.element_of(row).to_owned(), self.named(&rows, &multipliers));
                return Err(ImpulseFault::Conflict { element, with });
            };
            pushing.advance(step, &response, &multipliers[locked.len()..]);
            impulse += step;
            match released {
                Some((_, place)) => drop(pushing.rows.remove(place)),
                None => {
                    pushing.rows.push((row, impulse));
                    return Ok(());
                }
            }
        }
    }

    /// Change of the speeds, and impulses of held rows and prescribed speeds, by a unit impulse of the one row
    /// of `own`.
    fn response(
        &self,
        hold: &ConstraintSolver<'_, T>,
        own: &ConstraintSolver<'_, T>,
    ) -> Option<(Vec<T>, Vec<T>)> {
        let mut force = Matrix::zeros(self.speeds(), 1);
        force.subtract(&own.acting(&[0]));
        let found = hold.solve(&force, None, || vec![T::of(1.0); hold.rows.rows])?;
        let column = |m: &Matrix<T>| (0..m.rows).map(|i| m[(i, 0)]).collect();
        Some((column(&found.acceleration), column(&found.torque)))
    }

    /// Names of the rows and prescribed speeds whose multiplier is not round-off.
    fn named(&self, rows: &[RowId], multipliers: &[T]) -> Vec<String> {
        let size = |m: &T| m.re().magnitude();
        let largest = multipliers.iter().fold(T::Values::zero_(), |l, m| size(m).larger(l));
        let counts =
            |m: &T| size(m).decide_with(largest, |size, largest| size > MULTIPLIER_RTOL * largest);
        let rows = rows.iter().map(|&row| self.element_of(row).to_owned());
        let prescribed = self.mechanism.prescribed.iter().map(|p| p.element.to_string());
        let all = rows.chain(prescribed).zip(multipliers);
        all.filter(|(_, m)| counts(m)).map(|(name, _)| name).collect()
    }
}

impl<T: Number> Pushing<T> {
    /// Step at which the first of the impulses comes to nothing, and its place; `multipliers` are their
    /// rates, behind those of `locked` rows.
    fn first_release(&self, multipliers: &[T], locked: usize) -> Option<(T, usize)> {
        let size = |m: &T| m.re().magnitude();
        let largest = multipliers.iter().fold(T::Values::zero_(), |l, m| size(m).larger(l));
        let mut first: Option<(T, usize)> = None;
        for (place, ((_, impulse), &rate)) in
            self.rows.iter().zip(&multipliers[locked..]).enumerate()
        {
            let falls =
                rate.re().decide_with(largest, |rate, largest| rate < -MULTIPLIER_RTOL * largest);
            let at = -*impulse / rate;
            let earlier = first.is_none_or(|(before, _)| {
                at.re().decide_with(before.re(), |at, before| at < before)
            });
            if falls && earlier {
                first = Some((at, place));
            }
        }
        first
    }

    fn advance(&mut self, step: T, response: &[T], rates: &[T]) {
        for (speed, &change) in self.speeds.iter_mut().zip(response) {
            *speed += change * step;
        }
        for ((_, impulse), &rate) in self.rows.iter_mut().zip(rates) {
            *impulse += rate * step;
        }
    }
}

/// Return true if the row of `own` is independent of the rows held.
fn is_independent<T: Number>(
    hold: &ConstraintSolver<'_, T>,
    own: &ConstraintSolver<'_, T>,
) -> bool {
    let (held, width) = (hold.rows.rows, hold.rows.cols);
    let mut all = Matrix::zeros(held + 1, width);
    for i in 0..held {
        all.row_mut(i).copy_from_slice(hold.rows.row(i));
    }
    all.row_mut(held).copy_from_slice(own.rows.row(0));
    let mut sizes = hold.sizes.clone();
    sizes.push(own.sizes[0]);
    independent_rows(&all, &sizes).last() == Some(&held)
}
