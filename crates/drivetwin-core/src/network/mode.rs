// SPDX-License-Identifier: MIT
//! The linear system of one mode (THEORY section 1): accelerations with some friction elements
//! stuck, their torques, and the torques through lossy gears.

use super::compile::Network;
use super::constraint_forces::{ConstraintForces, ConstraintSolver};
use super::constraints::{SpeedForm, constraint_matrix, constraint_sizes, force_map};
use super::linalg::{Matrix, SparseRows, is_nothing, is_zero, least_norm, solve};
use super::spectral_radius::spectral_radius_bound;
use crate::model::mechanism::{self, Loss, LossLaw};
use crate::number::{Number, Values};
use std::borrow::Cow;
use std::sync::OnceLock;

/// State of a lossy gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GearState {
    /// Turning, its loss set by direction of motion and of power.
    Meshing {
        /// Sign of the driving side's speed.
        sign: f64,
        /// Power flows from the driven to the driving side.
        power_reversed: bool,
    },
    /// At rest, held by its own loss.
    Locked,
}

/// Row that can keep a speed at zero: friction element or lossy gear, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowId {
    /// Friction element.
    Friction(usize),
    /// Lossy gear.
    Gear(usize),
}

/// Key of a mode: sticking friction elements and states of lossy gears, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModeKey {
    stuck: u32,
    locked: u32,
    power_reversed: u32,
    reverse: u32,
}

impl ModeKey {
    /// Key of the stuck elements and gear states.
    pub fn new(stuck: impl Iterator<Item = usize>, gears: &[GearState]) -> Self {
        let mut key = Self::default();
        stuck.for_each(|j| key.stuck |= 1 << j);
        for (i, gear) in gears.iter().enumerate() {
            match *gear {
                GearState::Locked => key.locked |= 1 << i,
                GearState::Meshing { sign, power_reversed } => {
                    key.power_reversed |= u32::from(power_reversed) << i;
                    key.reverse |= u32::from(sign < 0.0) << i;
                }
            }
        }
        key
    }

    /// State of lossy gear `i`.
    pub(super) fn gear(self, i: usize) -> GearState {
        if self.locked >> i & 1 == 1 {
            return GearState::Locked;
        }
        let sign = if self.reverse >> i & 1 == 1 { -1.0 } else { 1.0 };
        GearState::Meshing { sign, power_reversed: self.power_reversed >> i & 1 == 1 }
    }

    /// Rows that keep a speed at zero: friction elements, then gears.
    pub fn rows(self) -> Vec<RowId> {
        bits(self.stuck).map(RowId::Friction).chain(bits(self.locked).map(RowId::Gear)).collect()
    }
}

/// Linear maps over the basis.
#[derive(Clone, Debug)]
pub struct Mode<T> {
    /// Key the mode was compiled for.
    pub key: ModeKey,
    /// State derivatives, states × basis.
    pub derivative: Matrix<T>,
    /// Its entries that are not zero, for products with the basis.
    pub rates: SparseRows<T>,
    /// About the spectral radius of the motion, 1/s, without derivatives.
    pub spectral_radius: T,
    /// Rows at rest.
    pub stuck: Vec<RowId>,
    /// Their torques in that order (a held gear's is its loss torque), then the torques of
    /// prescribed speeds; rows × basis.
    pub stuck_torque: Matrix<T>,
    /// See [`Mode::multipliers`].
    multipliers: OnceLock<Matrix<T>>,
    /// See [`Mode::gear_torque`].
    gear_torque: OnceLock<Matrix<T>>,
    /// See [`Mode::table_torque`].
    pub(super) table_torque: OnceLock<Matrix<T>>,
    /// True if more rows stick than there are speeds to hold. The torque split then depends on the
    /// capacities.
    pub redundant: bool,
}

/// Matrices shared by all modes with the same states of the lossy gears.
#[derive(Clone, Debug)]
pub struct Motion<T> {
    /// Generalised forces per node torque, speeds × nodes.
    force_map: Matrix<T>,
    /// Generalised forces per acceleration of the independent speeds, speeds × speeds.
    mass: Matrix<T>,
    /// Generalised forces of all that does not hold a speed, speeds × basis.
    forces: Matrix<T>,
    /// Accelerations with nothing at rest, speeds × basis.
    free: Matrix<T>,
}

/// Bounds of the loss torque of a gear at rest, as lines over the torque through it: each bound is
/// `slope · λ + drag`; the upper is the larger, the lower the smaller of its pair.
#[derive(Clone, Copy, Debug)]
pub struct GearBounds<T> {
    /// Lines of the bound towards forward motion.
    pub upper: [(T, T); 2],
    /// Lines of the bound towards backward motion.
    pub lower: [(T, T); 2],
}

impl<T: Number> Loss<T> {
    /// True if the loss depends on the direction of power.
    pub fn is_directional(&self) -> bool {
        self.law == LossLaw::Dissipative
    }

    /// Factor between the torque that enters at the driving side and what the driven side gets, and
    /// the drag that is taken off before (with the sign of motion).
    fn factor(&self, sign: f64, power_reversed: bool) -> (T, T) {
        match (self.law, power_reversed) {
            (LossLaw::Paper, _) => (self.eta, T::zero_()),
            (LossLaw::Dissipative, false) => (self.eta, self.drag * sign),
            (LossLaw::Dissipative, true) => (self.eta_backward.recip(), self.drag_backward * sign),
        }
    }

    /// Drag torque of a rolling gear at its driving side, with the sign of motion.
    pub(super) fn drag_torque(&self, sign: f64, power_reversed: bool) -> T {
        self.factor(sign, power_reversed).1
    }

    /// Torque lost at the driving side of a rolling gear that `torque` enters.
    pub fn loss_torque(&self, torque: T, sign: f64, power_reversed: bool) -> T {
        let (factor, drag) = self.factor(sign, power_reversed);
        torque * (-factor + 1.0) + drag
    }

    /// Torque through the gear, in the direction of motion, above which power flows forward.
    pub fn threshold(&self) -> T {
        let slope = self.eta - self.eta_backward.recip();
        if is_nothing(slope) { T::zero_() } else { (self.drag - self.drag_backward) / slope }
    }

    /// Bounds at rest.
    pub fn bounds(&self) -> GearBounds<T> {
        let forward = (-self.eta + 1.0, self.drag);
        let power_reversed = (-self.eta_backward.recip() + 1.0, self.drag_backward);
        let mirrored = |(slope, drag): (T, T)| (slope, -drag);
        GearBounds {
            upper: [forward, power_reversed],
            lower: [mirrored(forward), mirrored(power_reversed)],
        }
    }
}

impl<T: Number> Network<T> {
    /// Speed that a row keeps at zero, over the independent speeds.
    pub fn slip_of(&self, row: RowId) -> &SpeedForm<T> {
        match row {
            RowId::Friction(j) => &self.frictions[j].slip,
            RowId::Gear(i) => &self.losses[i].speed,
        }
    }

    /// Return true for a one-way clutch.
    pub fn is_one_way(&self, row: RowId) -> bool {
        matches!(row, RowId::Friction(j) if self.frictions[j].one_way)
    }

    /// Name of a row's element.
    pub fn element_of(&self, row: RowId) -> &str {
        match row {
            RowId::Friction(j) => &self.frictions[j].element,
            RowId::Gear(i) => &self.losses[i].element,
        }
    }

    /// Compile one mode. `capacity[j]` weighs the torque split of redundant locks.
    /// `None` if the efficiencies leave the accelerations undetermined.
    pub fn mode(&self, key: ModeKey, capacity: &[T]) -> Option<Mode<T>> {
        let motion = self.motion_of(key)?;
        let stuck = key.rows();
        let found = if stuck.is_empty() && self.prescribed.is_empty() {
            let (acceleration, torque) = (motion.free.clone(), Matrix::zeros(0, self.basis()));
            ConstraintForces { acceleration, torque, redundant: false }
        } else {
            let hold = self.hold(&motion, &stuck);
            let rates = self.rates(stuck.len());
            hold.solve(&motion.forces, rates.as_ref(), || self.weights(&stuck, capacity))?
        };
        let derivative = self.with_other_states(&found.acceleration);
        Some(Mode {
            key,
            rates: SparseRows::of(&derivative),
            spectral_radius: T::promote(spectral_radius_bound(&derivative)),
            derivative,
            multipliers: OnceLock::new(),
            gear_torque: OnceLock::new(),
            table_torque: OnceLock::new(),
            stuck_torque: found.torque,
            stuck,
            redundant: found.redundant,
        })
    }

    /// Rows at rest and prescribed speeds in a motion.
    pub(super) fn hold<'m>(
        &self,
        motion: &'m Motion<T>,
        rows: &[RowId],
    ) -> ConstraintSolver<'m, T> {
        self.solver(&motion.mass, (!self.losses.is_empty()).then_some(&motion.force_map), rows)
    }

    /// Rows at rest and prescribed speeds of the mass matrix alone, whatever gears lose.
    pub fn hold_by_mass(&self, rows: &[RowId]) -> ConstraintSolver<'_, T> {
        self.solver(&self.mass, None, rows)
    }

    fn solver<'m>(
        &self,
        inertia: &'m Matrix<T>,
        force_map: Option<&Matrix<T>>,
        rows: &[RowId],
    ) -> ConstraintSolver<'m, T> {
        let (speeds, nodes) = self.build_held_speeds(rows);
        let acting = force_map.map(|map| map.times_columns(&nodes));
        let firm = (0..rows.len()).filter(|&i| self.is_one_way(rows[i])).collect();
        let sizes = rows.iter().map(|&row| self.slip_of(row).size);
        let sizes = sizes.chain(self.prescribed.iter().map(|(speed, _)| speed.size)).collect();
        ConstraintSolver { inertia, acting, rows: speeds, sizes, resting: rows.len(), firm }
    }

    /// Accelerations of held speeds over the basis, where some behind those at rest are prescribed.
    fn rates(&self, resting: usize) -> Option<Matrix<T>> {
        let count = self.prescribed.len();
        (count > 0).then(|| {
            let mut rates = Matrix::zeros(resting + count, self.basis());
            for i in 0..count {
                rates[(resting + i, self.first_rate() + i)] = T::of(1.0);
            }
            rates
        })
    }

    /// The motion that the modes of a key share; compiled with the network where it has no gear whose
    /// loss depends on its state.
    pub(super) fn motion_of(&self, key: ModeKey) -> Option<Cow<'_, Motion<T>>> {
        match &self.motion {
            Some(motion) => Some(Cow::Borrowed(motion)),
            None => self.motion(key).map(Cow::Owned),
        }
    }

    /// `None` if the efficiencies leave the accelerations undetermined.
    pub(super) fn motion(&self, key: ModeKey) -> Option<Motion<T>> {
        let sizes = constraint_sizes(&self.mechanism);
        let kt = force_map(self.force_rows(key), sizes, &self.coordinates)?.transposed();
        let mass = kt.times(&self.inertia).times(&self.coordinates.speeds);
        let forces = kt.times(&self.with_drag(key));
        let free = solve(mass.clone(), forces.clone()).ok()?;
        Some(Motion { force_map: kt, mass, forces, free })
    }

    /// The constraints as their forces act on the nodes: the driven side of a rolling gear gets what its
    /// efficiency leaves.
    pub(super) fn force_rows(&self, key: ModeKey) -> Matrix<T> {
        constraint_matrix(&self.mechanism, |constraint| {
            let i = self.losses.iter().position(|loss| loss.constraint == constraint)?;
            match key.gear(i) {
                GearState::Locked => None,
                GearState::Meshing { power_reversed, .. } => {
                    Some(self.losses[i].loss.factor(1.0, power_reversed).0)
                }
            }
        })
    }

    /// Node torques over the basis with the drag of rolling gears, which acts on their driven side.
    fn with_drag(&self, key: ModeKey) -> Cow<'_, Matrix<T>> {
        let mut torques = Cow::Borrowed(&self.node_torques);
        for (i, gear) in self.losses.iter().enumerate() {
            let GearState::Meshing { sign, power_reversed } = key.gear(i) else { continue };
            let drag = gear.loss.drag_torque(sign, power_reversed);
            if is_zero(drag) {
                continue;
            }
            for &(node, coefficient) in &self.mechanism.constraints[gear.constraint].row[1..] {
                torques.to_mut()[(node, self.one())] += coefficient * drag;
            }
        }
        torques
    }

    /// Speeds kept at zero or prescribed, over the independent speeds and over the nodes.
    pub fn build_held_speeds(&self, stuck: &[RowId]) -> (Matrix<T>, Vec<mechanism::Row<T>>) {
        let count = stuck.len() + self.prescribed.len();
        let mut speeds = Matrix::zeros(count, self.speeds());
        let mut nodes = Vec::with_capacity(count);
        let one = |node| mechanism::Row::from_elem((node, T::of(1.0)), 1);
        for (i, &row) in stuck.iter().enumerate() {
            speeds.row_mut(i).copy_from_slice(self.slip_of(row));
            nodes.push(match row {
                RowId::Friction(j) => self.frictions[j].nodes.clone(),
                RowId::Gear(g) => one(self.losses[g].loss.driving),
            });
        }
        for (i, (speed, _)) in self.prescribed.iter().enumerate() {
            speeds.row_mut(stuck.len() + i).copy_from_slice(speed);
            nodes.push(one(self.mechanism.prescribed[i].node));
        }
        (speeds, nodes)
    }

    /// Torque capacities of the held speeds, as weights of the split among redundant locks. One-way
    /// clutches and the prescribed speeds, which come last, get a large weight: they carry the remainder.
    fn weights(&self, stuck: &[RowId], capacity: &[T]) -> Vec<T> {
        let one = T::Values::of(1.0);
        let largest = capacity.iter().fold(one, |largest, c| c.re().larger(largest));
        let unbounded = T::promote(largest * 1e2);
        let weight = |&row: &RowId| match row {
            RowId::Friction(j) if !self.frictions[j].one_way => {
                let least = largest * 1e-3;
                let enough =
                    capacity[j].re().decide_with(least, |capacity, least| capacity > least);
                if enough { capacity[j] } else { T::promote(least) }
            }
            RowId::Friction(_) => unbounded,
            RowId::Gear(_) => T::of(1.0),
        };
        let prescribed = std::iter::repeat_n(unbounded, self.prescribed.len());
        stuck.iter().map(weight).chain(prescribed).collect()
    }

    /// Torque that enters each lossy gear at its driving side, see [`Self::multipliers`].
    pub(super) fn entering(&self, key: ModeKey, residual: &Matrix<T>) -> Matrix<T> {
        self.multipliers(key, residual).select_rows(&self.lossy())
    }

    /// Constraints with a loss.
    fn lossy(&self) -> Vec<usize> {
        self.losses.iter().map(|loss| loss.constraint).collect()
    }

    /// Torque of each constraint on its first entry, computed from the residual of the node balance, which
    /// has a solution.
    fn multipliers(&self, key: ModeKey, residual: &Matrix<T>) -> Matrix<T> {
        let dependent = &self.coordinates.dependent;
        let balance = self.force_rows(key).select_columns(dependent).transposed();
        let residual = residual.select_rows(dependent);
        solve(balance.clone(), residual.clone()).unwrap_or_else(|_| least_norm(&balance, &residual))
    }

    fn with_other_states(&self, acceleration: &Matrix<T>) -> Matrix<T> {
        let mut derivative = Matrix::zeros(self.states(), self.basis());
        for i in 0..self.speeds() {
            derivative.row_mut(i).copy_from_slice(acceleration.row(i));
        }
        for i in 0..self.twist_rates.rows {
            let rate = self.twist_rates.row(i);
            derivative.row_mut(self.speeds() + i)[..rate.len()].copy_from_slice(rate);
        }
        for (i, lag) in self.lags.iter().enumerate() {
            let state = self.first_lag() + i;
            derivative[(state, state)] -= lag.time.recip();
            derivative[(state, lag.target)] += lag.time.recip();
        }
        derivative
    }
}

impl<T: Number> Mode<T> {
    /// Torque of a row at rest over the basis; none for other rows.
    pub fn holding_torque(&self, row: RowId) -> Option<&[T]> {
        let position = self.stuck.iter().position(|&stuck| stuck == row)?;
        Some(self.stuck_torque.row(position))
    }

    /// Multipliers of the constraints, constraints × basis, from the balance of the dependent nodes,
    /// `D_depᵀ λ = (f - I ω')_dep`. Computed when first asked for.
    pub(super) fn multipliers(&self, network: &Network<T>) -> &Matrix<T> {
        self.multipliers.get_or_init(|| {
            let (_, nodes) = network.build_held_speeds(&self.stuck);
            let mut acceleration = Matrix::zeros(network.speeds(), network.basis());
            for i in 0..network.speeds() {
                acceleration.row_mut(i).copy_from_slice(self.derivative.row(i));
            }
            let inertia = network.inertia.times(&network.coordinates.speeds);
            let mut residual = network.with_drag(self.key).into_owned();
            subtract_held(&mut residual, &nodes, &self.stuck_torque);
            residual.subtract(&inertia.times(&acceleration));
            network.multipliers(self.key, &residual)
        })
    }

    /// Torque entering each lossy gear at its driving side, losses × basis: the multipliers of their
    /// constraints, and at rest the loss torque on top. Computed when first asked for.
    pub fn gear_torque(&self, network: &Network<T>) -> &Matrix<T> {
        self.gear_torque.get_or_init(|| {
            let mut entering = self.multipliers(network).select_rows(&network.lossy());
            for (position, &row) in self.stuck.iter().enumerate() {
                if let RowId::Gear(i) = row {
                    let loss = self.stuck_torque.row(position);
                    entering.row_mut(i).iter_mut().zip(loss).for_each(|(total, &l)| *total += l);
                }
            }
            entering
        })
    }
}

/// Take off node torques what held speeds exert: their nodes and their torques, one row each.
pub(super) fn subtract_held<T: Number>(
    node_torques: &mut Matrix<T>,
    nodes: &[mechanism::Row<T>],
    torques: &Matrix<T>,
) {
    for (i, held) in nodes.iter().enumerate() {
        for &(node, direction) in held {
            node_torques.subtract_from_row(node, torques.row(i), direction);
        }
    }
}

/// Numbers of the bits that are set.
fn bits(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = set.trailing_zeros();
        set &= set.checked_sub(1)?;
        Some(lowest as usize)
    })
}
