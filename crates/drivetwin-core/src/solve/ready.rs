// SPDX-License-Identifier: MIT
//! The operators that pass samples in the present regime, and the guards they watch.

use super::decide::NO_TORQUE;
use super::operators::{MAX_ACTIVE, MAX_WATCHED, Operators};
use super::regime::{Regime, RowState};
use crate::network::channel::{self, Channel};
use crate::network::smooth::{Law, Line, MAX_INPUTS, line_of};
use crate::network::{Cell, GearState, ModeKey, Network, Row};
use crate::number::{Lane, Number};
use std::sync::Arc;

/// Operators for the number of states at hand.
#[derive(Clone, Debug)]
pub(super) enum AnySize<T> {
    /// Up to 4.
    Four(Arc<Operators<T, 4>>),
    /// Up to 8; of one run only.
    Eight(Arc<Operators<T, 8>>),
    /// Up to 12; of plain numbers only.
    Twelve(Arc<Operators<T, 12>>),
    /// Up to [`MAX_STATES`]; likewise.
    Many(Arc<Operators<T, MAX_STATES>>),
}

/// Most states of a network of plain numbers that is marched.
const MAX_STATES: usize = 24;

/// Most states of a network over `T` that is marched. With derivatives the gain with more does not pay for the
/// code, and several runs side by side are drivelines of two clutches.
const fn max_states<T: Lane>() -> usize {
    if T::RUNS > 1 {
        4
    } else if T::DERIVATIVES {
        8
    } else {
        MAX_STATES
    }
}

/// Whether a network is of the kind that passes samples by exact operators.
pub fn can_march<T: Number>(network: &Network<T>) -> bool {
    let smooth = |channel: &Channel<T>| {
        matches!(channel.law, channel::Law::Friction { .. } | channel::Law::Quadratic(_))
    };
    network.states() <= max_states::<T>()
        && network.prescribed.is_empty()
        && network.mechanism.inputs.len() <= MAX_INPUTS
        && network.channels.iter().all(smooth)
}

/// What operators belong to: mode, active channels with their branches, and step length.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    mode: ModeKey,
    /// Bits of the active channels, of their directions, and of what is watched or pressed.
    branches: [u64; 3],
    pieces: [u8; MAX_ACTIVE],
    /// Step length, ps: times that differ by round-off share their operators.
    step: u64,
}

/// What passing samples needs.
pub(super) struct Ready<T> {
    /// Operators of the present mode.
    pub operators: AnySize<T>,
    /// Channels that are not off.
    pub active: Vec<usize>,
}

impl<T: Number> Regime<'_, T> {
    /// What passing samples of length `h` [s] needs, if it is possible.
    pub(super) fn ready(&mut self, h: f64) -> Option<Ready<T>> {
        if !self.is_simple() {
            return None;
        }
        let on = |j: &usize| self.cells[*j] != Cell::Off;
        let active: Vec<usize> = (0..self.cells.len()).filter(on).collect();
        let operators = self.operators(&active, h)?;
        Some(Ready { operators, active })
    }

    /// Operators of the present mode, if they apply.
    fn operators(&mut self, active: &[usize], h: f64) -> Option<AnySize<T>> {
        if active.len() > MAX_ACTIVE {
            return None;
        }
        let key = self.key(active, h);
        if let Some(known) = self.known.operators.get(&key) {
            return known.clone();
        }
        let laws = active.iter().map(|&j| Law::of(&self.network.channels[j], self.cells[j]));
        let built = laws.collect::<Option<Vec<_>>>().and_then(|laws| match self.network.states() {
            0..=4 => self.build::<4>(active, &laws, h).map(|o| AnySize::Four(Arc::new(o))),
            5..=8 if T::RUNS == 1 => {
                self.build::<8>(active, &laws, h).map(|o| AnySize::Eight(Arc::new(o)))
            }
            9..=12 if max_states::<T>() == MAX_STATES => {
                self.build::<12>(active, &laws, h).map(|o| AnySize::Twelve(Arc::new(o)))
            }
            13..=MAX_STATES if max_states::<T>() == MAX_STATES => {
                self.build::<MAX_STATES>(active, &laws, h).map(|o| AnySize::Many(Arc::new(o)))
            }
            _ => None,
        });
        self.known.operators.insert(key, built.clone());
        built
    }

    fn key(&self, active: &[usize], h: f64) -> Key {
        let mut branches = [0; 3];
        let mut pieces = [0; MAX_ACTIVE];
        for (slot, &j) in active.iter().enumerate() {
            branches[0] |= 1 << j;
            if let Cell::Moving { sign, piece } = self.cells[j] {
                branches[1] |= u64::from(sign < 0.0) << j;
                pieces[slot] = piece as u8;
            }
        }
        for (j, row) in self.rows.iter().enumerate() {
            branches[2] |= u64::from(self.pressed[j]) << j;
            branches[2] |= u64::from(matches!(row, RowState::Slipping { .. })) << (32 + j);
        }
        Key { mode: self.mode.key, branches, pieces, step: (h * 1e12).round() as u64 }
    }

    /// Whether the present mode has only what a sprint covers.
    fn is_simple(&self) -> bool {
        self.network.prescribed.is_empty()
            && self.network.mechanism.inputs.len() <= MAX_INPUTS
            && !self.mode.redundant
            && !self.blocked.contains(&true)
            && !self.released.contains(&true)
            && !self.rows.iter().any(RowState::is_saturated)
            && self.gears.iter().all(|gear| *gear != GearState::Held)
    }

    /// Build operators that watch all guards of the present mode.
    fn build<const N: usize>(
        &self,
        active: &[usize],
        laws: &[Law<T>],
        h: f64,
    ) -> Option<Operators<T, N>> {
        let mut operators = Operators::build(self.network, &self.mode, (active, laws), h)?;
        self.watch_frictions((active, h), &mut operators);
        self.watch_gears((active, h), &mut operators);
        (operators.watched.len() <= MAX_WATCHED).then_some(operators)
    }

    fn watch_frictions<const N: usize>(
        &self,
        (active, h): (&[usize], f64),
        operators: &mut Operators<T, N>,
    ) {
        for (j, row) in self.network.frictions.iter().enumerate() {
            let side = if self.pressed[j] { 1.0 } else { -1.0 };
            let load = line_of(&row.normal);
            // At the end of a sample the load is a sum, with round-off of its own.
            let nothing = row.normal.nothing() + if self.pressed[j] { NO_TORQUE } else { 0.0 };
            let above = Line { offset: load.offset - nothing, ..load };
            operators.loads.push(above.map(|v| v * side));
            match self.rows[j] {
                RowState::Stuck => {
                    let mu = if self.pressed[j] {
                        row.law.at(T::zero_()) * row.peak
                    } else {
                        T::zero_()
                    };
                    let position = self.mode.stuck.iter().position(|&s| s == Row::Friction(j));
                    let position = position.expect("a stuck element belongs to the mode");
                    let torque = self.mode.stuck_torque.row(position);
                    let mut limit = load.map(|v| v * mu);
                    limit.offset += if row.one_way { NO_TORQUE } else { 0.0 };
                    operators.watch_torque(self.network, active, torque, (limit, !row.one_way));
                }
                RowState::Slipping { sign } if !active.contains(&j) => {
                    let speed: Vec<T> = row.slip.iter().map(|&c| c * sign).collect();
                    operators.watch_speed((self.network, &self.mode), active, &speed, h);
                }
                _ => {}
            }
        }
    }

    fn watch_gears<const N: usize>(
        &self,
        (active, h): (&[usize], f64),
        operators: &mut Operators<T, N>,
    ) {
        for (i, gear) in self.network.losses.iter().enumerate() {
            let GearState::Rolling { sign, backward } = self.gears[i] else { continue };
            if !gear.loss.is_directional() {
                continue;
            }
            let side = if backward { -1.0 } else { 1.0 };
            let scaled = |row: &[T], by: f64| row.iter().map(|&c| c * by).collect::<Vec<T>>();
            let power = scaled(self.mode.gear_torque(self.network).row(i), sign * side);
            let limit = constant(-gear.loss.threshold() * side + NO_TORQUE);
            operators.watch_torque(self.network, active, &power, (limit, false));
            let speed = scaled(&gear.speed, sign);
            operators.watch_speed((self.network, &self.mode), active, &speed, h);
        }
    }
}

fn constant<T: Number>(value: T) -> Line<T> {
    Line { input: 0, gain: T::zero_(), offset: value }
}
