// SPDX-License-Identifier: MIT
//! The linear system of one mode (THEORY section 1): accelerations with some friction elements
//! stuck, their torques, and the torques through lossy gears.

use super::compile::Network;
use super::constraints::{constraint_matrix, force_map};
use super::linalg::{Matrix, SparseRows, independent_rows, is_nothing, is_zero, least_norm, solve};
use super::radius::radius;
use crate::model::mechanism::{self, Loss, LossLaw};
use crate::number::{Number, Values};
use std::borrow::Cow;
use std::sync::OnceLock;

/// How a lossy gear moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GearState {
    /// Turning, its loss set by direction of motion and of power.
    Rolling {
        /// Sign of the driving side's speed.
        sign: f64,
        /// Power flows from the driven to the driving side.
        backward: bool,
    },
    /// At rest, held by its own loss.
    Held,
}

/// Something that keeps a speed at zero: friction element or lossy gear, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Row {
    /// Friction element.
    Friction(usize),
    /// Lossy gear.
    Gear(usize),
}

/// Which friction elements are stuck and how the lossy gears move, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModeKey {
    stuck: u32,
    held: u32,
    backward: u32,
    reverse: u32,
}

impl ModeKey {
    /// Key of the stuck elements and gear states.
    pub fn new(stuck: impl Iterator<Item = usize>, gears: &[GearState]) -> Self {
        let mut key = Self::default();
        stuck.for_each(|j| key.stuck |= 1 << j);
        for (i, gear) in gears.iter().enumerate() {
            match *gear {
                GearState::Held => key.held |= 1 << i,
                GearState::Rolling { sign, backward } => {
                    key.backward |= u32::from(backward) << i;
                    key.reverse |= u32::from(sign < 0.0) << i;
                }
            }
        }
        key
    }

    /// Rows that keep a speed at zero: friction elements, then gears.
    pub fn rows(self) -> Vec<Row> {
        bits(self.stuck).map(Row::Friction).chain(bits(self.held).map(Row::Gear)).collect()
    }
}

/// Linear maps over the basis.
#[derive(Clone, Debug)]
pub struct Mode<T> {
    /// What it was compiled for.
    pub key: ModeKey,
    /// State derivatives, states × basis.
    pub derivative: Matrix<T>,
    /// Its entries that are not zero, for products with the basis.
    pub rates: SparseRows<T>,
    /// About the spectral radius of the motion, 1/s, without derivatives.
    pub radius: T,
    /// Rows at rest.
    pub stuck: Vec<Row>,
    /// Their torques in that order (a held gear's is its loss torque), then the torques of
    /// prescribed speeds; rows × basis.
    pub stuck_torque: Matrix<T>,
    /// See [`Mode::gear_torque`].
    gear_torque: OnceLock<Matrix<T>>,
    /// Whether more is stuck than there are speeds to hold; the torque split then depends on the
    /// capacities.
    pub redundant: bool,
}

/// What all modes with the same states of the lossy gears share.
#[derive(Clone, Debug)]
pub struct Motion<T> {
    /// Accelerations of the independent speeds per node torque, speeds × nodes.
    mobility: Matrix<T>,
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
    /// Whether the loss depends on the direction of power.
    pub fn is_directional(&self) -> bool {
        self.law == LossLaw::Dissipative
    }

    /// Factor between the torque that enters at the driving side and what the driven side gets, and
    /// the drag that is taken off before (with the sign of motion).
    fn factor(&self, sign: f64, backward: bool) -> (T, T) {
        match (self.law, backward) {
            (LossLaw::Paper, _) => (self.eta, T::zero_()),
            (LossLaw::Dissipative, false) => (self.eta, self.drag * sign),
            (LossLaw::Dissipative, true) => (self.eta_backward.recip(), self.drag_backward * sign),
        }
    }

    /// Torque lost at the driving side of a rolling gear that `torque` enters.
    pub fn loss_torque(&self, torque: T, sign: f64, backward: bool) -> T {
        let (factor, drag) = self.factor(sign, backward);
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
        let backward = (-self.eta_backward.recip() + 1.0, self.drag_backward);
        let mirrored = |(slope, drag): (T, T)| (slope, -drag);
        GearBounds { upper: [forward, backward], lower: [mirrored(forward), mirrored(backward)] }
    }
}

impl<T: Number> Network<T> {
    /// Speed that a row keeps at zero, over the independent speeds.
    pub fn slip_of(&self, row: Row) -> &[T] {
        match row {
            Row::Friction(j) => &self.frictions[j].slip,
            Row::Gear(i) => &self.losses[i].speed,
        }
    }

    /// Name of a row's element.
    pub fn element_of(&self, row: Row) -> &str {
        match row {
            Row::Friction(j) => &self.frictions[j].element,
            Row::Gear(i) => &self.losses[i].element,
        }
    }

    /// Compile one mode. `capacity[j]` weighs the torque split of redundant locks.
    /// `None` if the efficiencies leave the accelerations undetermined.
    pub fn mode(&self, key: ModeKey, capacity: &[T]) -> Option<Mode<T>> {
        let motion = self.motion_of(key)?;
        let stuck = key.rows();
        let mut derivative = self.with_other_states(&motion.free);
        let (stuck_torque, redundant) = if stuck.is_empty() && self.prescribed.is_empty() {
            (Matrix::zeros(0, self.basis()), false)
        } else {
            let (speeds, nodes) = self.held_speeds(&stuck);
            let response = motion.mobility.times_columns(&nodes);
            let mut needed = speeds.times(&motion.free);
            for i in 0..self.prescribed.len() {
                needed[(stuck.len() + i, self.first_rate() + i)] -= 1.0;
            }
            let weights = || self.weights(&stuck, capacity);
            let (torque, redundant) =
                holding_torque(speeds.times(&response), needed, weights, stuck.len());
            derivative.subtract(&response.times(&torque));
            (torque, redundant)
        };
        Some(Mode {
            key,
            rates: SparseRows::of(&derivative),
            radius: T::lifted(radius(&derivative)),
            derivative,
            gear_torque: OnceLock::new(),
            stuck_torque,
            stuck,
            redundant,
        })
    }

    /// The motion that the modes of a key share; compiled with the network where it has no gear whose
    /// loss depends on its state.
    fn motion_of(&self, key: ModeKey) -> Option<Cow<'_, Motion<T>>> {
        match &self.motion {
            Some(motion) => Some(Cow::Borrowed(motion)),
            None => self.motion(key).map(Cow::Owned),
        }
    }

    /// `None` if the efficiencies leave the accelerations undetermined.
    pub(super) fn motion(&self, key: ModeKey) -> Option<Motion<T>> {
        let kt = force_map(self.force_rows(key), &self.coordinates)?.transposed();
        let mass = kt.times(&self.inertia).times(&self.coordinates.speeds);
        let mobility = solve(mass, kt).ok()?;
        let free = mobility.times(&self.with_drag(key));
        Some(Motion { mobility, free })
    }

    /// The constraints as their forces act on the nodes: the driven side of a rolling gear gets what its
    /// efficiency leaves.
    fn force_rows(&self, key: ModeKey) -> Matrix<T> {
        constraint_matrix(&self.mechanism, |constraint| {
            let i = self.losses.iter().position(|loss| loss.constraint == constraint)?;
            let held = key.held >> i & 1 == 1;
            let backward = key.backward >> i & 1 == 1;
            (!held).then(|| self.losses[i].loss.factor(1.0, backward).0)
        })
    }

    /// Node torques over the basis with the drag of rolling gears, which acts on their driven side.
    fn with_drag(&self, key: ModeKey) -> Cow<'_, Matrix<T>> {
        let mut torques = Cow::Borrowed(&self.node_torques);
        for (i, gear) in self.losses.iter().enumerate() {
            if key.held >> i & 1 == 1 {
                continue;
            }
            let sign = if key.reverse >> i & 1 == 1 { -1.0 } else { 1.0 };
            let (_, drag) = gear.loss.factor(sign, key.backward >> i & 1 == 1);
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
    fn held_speeds(&self, stuck: &[Row]) -> (Matrix<T>, Vec<mechanism::Row<T>>) {
        let count = stuck.len() + self.prescribed.len();
        let mut speeds = Matrix::zeros(count, self.speeds());
        let mut nodes = Vec::with_capacity(count);
        let one = |node| mechanism::Row::from_elem((node, T::of(1.0)), 1);
        for (i, &row) in stuck.iter().enumerate() {
            speeds.row_mut(i).copy_from_slice(self.slip_of(row));
            nodes.push(match row {
                Row::Friction(j) => self.frictions[j].nodes.clone(),
                Row::Gear(g) => one(self.losses[g].loss.driving),
            });
        }
        for (i, (speed, _)) in self.prescribed.iter().enumerate() {
            speeds.row_mut(stuck.len() + i).copy_from_slice(speed);
            nodes.push(one(self.mechanism.prescribed[i].node));
        }
        (speeds, nodes)
    }

    /// What each held speed's torque can be, for the split of redundant locks; prescribed speeds,
    /// which come last, and one-way clutches carry what the others cannot.
    fn weights(&self, stuck: &[Row], capacity: &[T]) -> Vec<T> {
        let one = T::Values::of(1.0);
        let largest = capacity.iter().fold(one, |largest, c| c.re().larger(largest));
        let unbounded = T::lifted(largest * 1e2);
        let weight = |&row: &Row| match row {
            Row::Friction(j) if !self.frictions[j].one_way => {
                let least = largest * 1e-3;
                let enough =
                    capacity[j].re().decide_with(least, |capacity, least| capacity > least);
                if enough { capacity[j] } else { T::lifted(least) }
            }
            Row::Friction(_) => unbounded,
            Row::Gear(_) => T::of(1.0),
        };
        let prescribed = std::iter::repeat_n(unbounded, self.prescribed.len());
        stuck.iter().map(weight).chain(prescribed).collect()
    }

    /// What enters each lossy gear at its driving side, by what is left of the balance of the nodes.
    fn entering(&self, key: ModeKey, residual: &Matrix<T>) -> Matrix<T> {
        let dependent = &self.coordinates.dependent;
        let balance = self.force_rows(key).select_columns(dependent).transposed();
        let multipliers = solve(balance, residual.select_rows(dependent));
        let multipliers = multipliers.expect("the forces determine the accelerations");
        let lossy: Vec<usize> = self.losses.iter().map(|loss| loss.constraint).collect();
        multipliers.select_rows(&lossy)
    }

    /// What impulses that take `excess` (rows and prescribed speeds × 1, rad/s) off the speeds of rows take off
    /// the independent speeds, speeds × 1, and what of them enters each lossy gear, losses × 1. They act
    /// through the gears as torques do: `KᵀIN Δv = -Kᵀ g λ`. `None` as of [`Network::mode`].
    pub fn impulse(
        &self,
        key: ModeKey,
        rows: &[Row],
        excess: &Matrix<T>,
    ) -> Option<(Matrix<T>, Matrix<T>)> {
        let motion = self.motion_of(key)?;
        let (speeds, nodes) = self.held_speeds(rows);
        let response = motion.mobility.times_columns(&nodes);
        let impulses = held_by(&speeds.times(&response), excess, rows.len());
        let change = response.times(&impulses);
        let mut residual = self.inertia.times(&self.coordinates.speeds).times(&change);
        subtract_held(&mut residual, &nodes, &impulses);
        Some((change, self.entering(key, &residual)))
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
    /// Torque entering each lossy gear at its driving side, losses × basis: the multipliers of their
    /// constraints from the balance of the dependent nodes, `D_depᵀ λ = (f - I ω')_dep`, and at rest
    /// the loss torque on top. Computed when first asked for.
    pub fn gear_torque(&self, network: &Network<T>) -> &Matrix<T> {
        self.gear_torque.get_or_init(|| {
            let (_, nodes) = network.held_speeds(&self.stuck);
            let mut acceleration = Matrix::zeros(network.speeds(), network.basis());
            for i in 0..network.speeds() {
                acceleration.row_mut(i).copy_from_slice(self.derivative.row(i));
            }
            let inertia = network.inertia.times(&network.coordinates.speeds);
            let mut residual = network.with_drag(self.key).into_owned();
            subtract_held(&mut residual, &nodes, &self.stuck_torque);
            residual.subtract(&inertia.times(&acceleration));
            let mut entering = network.entering(self.key, &residual);
            for (position, &row) in self.stuck.iter().enumerate() {
                if let Row::Gear(i) = row {
                    let loss = self.stuck_torque.row(position);
                    entering.row_mut(i).iter_mut().zip(loss).for_each(|(total, &l)| *total += l);
                }
            }
            entering
        })
    }
}

/// Take off node torques what held speeds exert: their nodes and their torques, one row each.
fn subtract_held<T: Number>(
    node_torques: &mut Matrix<T>,
    nodes: &[mechanism::Row<T>],
    torques: &Matrix<T>,
) {
    for (i, held) in nodes.iter().enumerate() {
        for &(node, direction) in held {
            node_torques.subtract_from_row(node, (torques.row(i), direction));
        }
    }
}

/// Least-norm solution of `W x = b` for what holds speeds; those prescribed, from row `stuck` on, win where the
/// rows contradict each other.
pub fn held_by<T: Number>(w: &Matrix<T>, b: &Matrix<T>, stuck: usize) -> Matrix<T> {
    let order: Vec<usize> = (stuck..w.rows).chain(0..stuck).collect();
    least_norm(&w.select_rows(&order), &b.select_rows(&order))
}

/// Solve `W τ = b` for the torques that hold the speeds. For redundant locks the torques are those of
/// least `Σ (τ_j / weight_j)²`.
fn holding_torque<T: Number>(
    w: Matrix<T>,
    b: Matrix<T>,
    weights: impl FnOnce() -> Vec<T>,
    stuck: usize,
) -> (Matrix<T>, bool) {
    if independent_rows(&w).len() == w.rows
        && let Ok(torque) = solve(w.clone(), b.clone())
    {
        return (torque, false);
    }
    let weights = weights();
    let mut scaled = w;
    for r in 0..scaled.rows {
        for c in 0..scaled.cols {
            scaled[(r, c)] *= weights[c];
        }
    }
    let mut torque = held_by(&scaled, &b, stuck);
    for i in 0..torque.rows {
        torque.row_mut(i).iter_mut().for_each(|t| *t *= weights[i]);
    }
    (torque, true)
}

/// Numbers of the bits that are set.
fn bits(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = set.trailing_zeros();
        set &= set.checked_sub(1)?;
        Some(lowest as usize)
    })
}
