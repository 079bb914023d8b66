// SPDX-License-Identifier: MIT
//! Plan of fixed steps in the present mode: the propagator and its guards.

use crate::network::nonlinear_torque::TorqueLaw;
use crate::network::smooth_law::{AffineForm, MAX_INPUTS, SmoothLaw, normal_load};
use crate::network::{Branch, GearState, Network, NonlinearTorque, RowId};
use crate::number::{KernelFloat, Number};
use crate::solver::exponential::guard_plan::TorqueGuard;
use crate::solver::exponential::propagator::{MAX_ACTIVE, Propagator};
use crate::solver::exponential::propagator_cache::{
    MANY, MAX_STATES, PropagatorCache, PropagatorKey, SizedPropagator,
};
use crate::solver::hybrid::event::FrictionState;
use crate::solver::hybrid::state::HybridState;
use crate::solver::sine::Wave;
use crate::solver::tolerances::TORQUE_ATOL;
use std::sync::Arc;

/// Most states of runs side by side that propagators pass, those of drivelines of two clutches.
const MAX_LOCKSTEP_STATES: usize = 4;
/// Most states of runs side by side that are expanded throughout: one step fills the nearest cache.
const MAX_EXPANDED_STATES: usize = 8;

/// Most states of a network over `T` that is marched. With derivatives the gain with more does not pay for the
/// code.
const fn max_states<T: KernelFloat>() -> usize {
    if T::RUNS > 1 {
        MAX_LOCKSTEP_STATES
    } else if T::DERIVATIVES {
        8
    } else {
        MAX_STATES
    }
}

/// Return true if propagators can pass the samples of a network.
pub fn supports_fixed_step<T: Number>(network: &Network<T>) -> bool {
    network.states() <= max_states::<T>()
        && network.prescribed.is_empty()
        && network.mechanism.inputs.len() <= MAX_INPUTS
        && network.channels.iter().all(propagated)
}

/// Return true if operators carry the law of a channel.
fn propagated<T: Number>(channel: &NonlinearTorque<T>) -> bool {
    matches!(channel.law, TorqueLaw::Friction { .. } | TorqueLaw::Quadratic(_))
}

/// Return true if several runs of a network can go side by side: by propagators, or by expansions
/// throughout where a tyre has none. Pieces of a table have none either, but runs leave them at times of
/// their own, and would part.
pub fn supports_lockstep<T: Number>(network: &Network<T>) -> bool {
    let analytic = |channel: &NonlinearTorque<T>| {
        propagated(channel) || matches!(channel.law, TorqueLaw::Slip { .. })
    };
    if supports_fixed_step(network) {
        return network.states() <= MAX_LOCKSTEP_STATES;
    }
    network.states() <= MAX_EXPANDED_STATES
        && network.prescribed.is_empty()
        && network.massless.is_empty()
        && network.table_losses.is_empty()
        && network.channels.iter().all(analytic)
}

/// Things that operators are built for, beside the mode.
#[derive(Clone, Copy)]
struct Given<'g, T> {
    active: &'g [usize],
    laws: &'g [SmoothLaw<T>],
    waves: &'g [Option<Wave>],
    h: f64,
}

/// Propagator and active channels of fixed steps.
pub(crate) struct StepPlan<T> {
    /// Operators of the present mode.
    pub operators: SizedPropagator<T>,
    /// Channels that are not off.
    pub active: Vec<usize>,
}

impl<T: Number> HybridState<'_, T> {
    /// Plan fixed steps of length `h` [s]. Return None if the mode does not allow them.
    pub(crate) fn plan_steps(
        &mut self,
        propagators: &mut PropagatorCache<T>,
        waves: &[Option<Wave>],
        h: f64,
    ) -> Option<StepPlan<T>> {
        if !self.is_simple() {
            return None;
        }
        let on = |j: &usize| self.branches[*j] != Branch::Off;
        let active: Vec<usize> = (0..self.branches.len()).filter(on).collect();
        let operators = self.operators(propagators, &active, waves, h)?;
        Some(StepPlan { operators, active })
    }

    /// Operators of the present mode, if they apply.
    fn operators(
        &mut self,
        propagators: &mut PropagatorCache<T>,
        active: &[usize],
        waves: &[Option<Wave>],
        h: f64,
    ) -> Option<SizedPropagator<T>> {
        if active.len() > MAX_ACTIVE {
            return None;
        }
        let key = self.key(active, waves, h);
        if let Some(known) = propagators.entries.get(&key) {
            return known.clone();
        }
        let laws = active
            .iter()
            .map(|&j| SmoothLaw::from_channel(&self.network.channels[j], self.branches[j]));
        let built = laws.collect::<Option<Vec<_>>>().and_then(|laws| {
            let given = Given { active, laws: &laws, waves, h };
            match self.network.states() {
                0..=4 => self.build::<4>(given).map(|o| SizedPropagator::Four(Arc::new(o))),
                5..=8 if T::RUNS == 1 => {
                    self.build::<8>(given).map(|o| SizedPropagator::Eight(Arc::new(o)))
                }
                9..=12 if max_states::<T>() == MAX_STATES => {
                    self.build::<12>(given).map(|o| SizedPropagator::Twelve(Arc::new(o)))
                }
                13..=MANY if max_states::<T>() == MAX_STATES => {
                    self.build::<MANY>(given).map(|o| SizedPropagator::Many(Arc::new(o)))
                }
                ..=MAX_STATES if max_states::<T>() == MAX_STATES && active.is_empty() => {
                    self.build::<MAX_STATES>(given).map(|o| SizedPropagator::Most(Arc::new(o)))
                }
                _ => None,
            }
        });
        propagators.entries.insert(key, built.clone());
        built
    }

    fn key(&self, active: &[usize], waves: &[Option<Wave>], h: f64) -> PropagatorKey {
        let mut branches = [0; 3];
        let mut pieces = [0; MAX_ACTIVE];
        for (slot, &j) in active.iter().enumerate() {
            branches[0] |= 1 << j;
            if let Branch::Moving { sign, piece } = self.branches[j] {
                branches[1] |= u64::from(sign < 0.0) << j;
                pieces[slot] = piece as u8;
            }
        }
        for (j, row) in self.rows.iter().enumerate() {
            branches[2] |= u64::from(self.pressed[j]) << j;
            branches[2] |= u64::from(matches!(row, FrictionState::Slipping { .. })) << (32 + j);
        }
        let bits = |wave: &Option<Wave>| wave.map(|w| [w.omega.to_bits(), w.offset.to_bits()]);
        let waves = waves.iter().map(bits).collect();
        PropagatorKey {
            mode: self.mode.key,
            branches,
            pieces,
            waves,
            step: (h * 1e12).round() as u64,
        }
    }

    /// Return true if fixed steps cover the present mode.
    fn is_simple(&self) -> bool {
        self.network.prescribed.is_empty()
            && self.network.mechanism.inputs.len() <= MAX_INPUTS
            && !self.mode.redundant
            && !self.blocked.contains(&true)
            && !self.released.contains(&true)
            && !self.rows.iter().any(FrictionState::is_saturated)
            && self.gears.iter().all(|gear| *gear != GearState::Locked)
    }

    /// Build operators that watch all guards of the present mode.
    fn build<const N: usize>(&self, given: Given<'_, T>) -> Option<Propagator<T, N>> {
        let Given { active, laws, waves, h } = given;
        let mut operators = Propagator::build(self.network, &self.mode, active, laws, waves, h)?;
        self.guard_frictions(active, h, &mut operators);
        self.guard_gears(active, h, &mut operators);
        let waves = waves.iter().any(Option::is_some);
        let unwatched = operators.guards.is_empty() && operators.loads.is_empty();
        let sound = !waves || (unwatched && active.is_empty());
        (sound && !operators.is_overfull).then_some(operators)
    }

    fn torque_guard<'w>(&'w self, active: &'w [usize], row: &'w [T], h: f64) -> TorqueGuard<'w, T> {
        TorqueGuard { network: self.network, mode: &self.mode, active, row, h }
    }

    fn guard_frictions<const N: usize>(
        &self,
        active: &[usize],
        h: f64,
        operators: &mut Propagator<T, N>,
    ) {
        for (j, row) in self.network.frictions.iter().enumerate() {
            let side = if self.pressed[j] { 1.0 } else { -1.0 };
            let load = normal_load(&row.normal);
            // At the end of a sample the load is a sum, with round-off of its own.
            let nothing =
                row.normal.load_tolerance() + if self.pressed[j] { TORQUE_ATOL } else { 0.0 };
            let above = AffineForm { offset: load.offset - nothing, ..load };
            operators.loads.push(above.map(|v| v * side));
            match self.rows[j] {
                FrictionState::Sticking => {
                    let mu = if self.pressed[j] {
                        row.law.at(T::zero_()) * row.peak
                    } else {
                        T::zero_()
                    };
                    let mut limit = load.map(|v| v * mu);
                    limit.offset += if row.one_way { TORQUE_ATOL } else { 0.0 };
                    if let Some(torque) = self.mode.holding_torque(RowId::Friction(j)) {
                        operators.guard_torque(
                            &self.torque_guard(active, torque, h),
                            limit,
                            !row.one_way,
                        );
                    }
                }
                FrictionState::Slipping { sign } if !active.contains(&j) => {
                    let speed: Vec<T> = row.slip.iter().map(|&c| c * sign).collect();
                    operators.guard_speed(self.network, &self.mode, active, &speed, h);
                }
                _ => {}
            }
        }
    }

    fn guard_gears<const N: usize>(
        &self,
        active: &[usize],
        h: f64,
        operators: &mut Propagator<T, N>,
    ) {
        for (i, gear) in self.network.losses.iter().enumerate() {
            let GearState::Meshing { sign, power_reversed } = self.gears[i] else { continue };
            if !gear.loss.is_directional() {
                continue;
            }
            let side = if power_reversed { -1.0 } else { 1.0 };
            let scaled = |row: &[T], by: f64| row.iter().map(|&c| c * by).collect::<Vec<T>>();
            let power = scaled(self.mode.gear_torque(self.network).row(i), sign * side);
            let limit = constant(-gear.loss.threshold() * side + TORQUE_ATOL);
            operators.guard_torque(&self.torque_guard(active, &power, h), limit, false);
            let speed = scaled(&gear.speed, sign);
            operators.guard_speed(self.network, &self.mode, active, &speed, h);
        }
    }
}

fn constant<T: Number>(value: T) -> AffineForm<T> {
    AffineForm { input: 0, gain: T::zero_(), offset: value }
}
