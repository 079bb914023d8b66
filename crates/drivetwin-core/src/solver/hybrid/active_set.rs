// SPDX-License-Identifier: MIT
//! Active set of the friction programme: the trial state of every friction element and gear.

use crate::network::{GearState, RowId};
use crate::solver::hybrid::event::FrictionState;

/// A trial: the state of every friction element and of every lossy gear.
#[derive(Clone, PartialEq)]
pub(crate) struct ActiveSet {
    /// Friction elements.
    pub rows: Vec<FrictionState>,
    /// Lossy gears.
    pub gears: Vec<GearState>,
}

impl ActiveSet {
    /// Set a row to sticking.
    pub fn rest(&mut self, row: RowId) {
        match row {
            RowId::Friction(j) => self.rows[j] = FrictionState::Sticking,
            RowId::Gear(i) => self.gears[i] = GearState::Locked,
        }
    }

    /// Set a row to slipping in a direction.
    pub fn move_off(&mut self, row: RowId, sign: f64) {
        match row {
            RowId::Friction(j) => self.rows[j] = FrictionState::Slipping { sign },
            RowId::Gear(i) => self.gears[i] = GearState::Meshing { sign, power_reversed: false },
        }
    }

    /// Count the friction elements that slip, and those that do not stick.
    pub fn moving_off(&self, candidates: &[RowId]) -> (usize, usize) {
        let friction = |row: &RowId| {
            if let RowId::Friction(j) = *row { Some(self.rows[j]) } else { None }
        };
        let rows = || candidates.iter().filter_map(friction);
        let moving = rows().filter(|row| matches!(row, FrictionState::Slipping { .. })).count();
        (moving, moving + rows().filter(FrictionState::is_saturated).count())
    }

    /// Reverse the power direction of a meshing gear.
    pub fn reverse_power(&mut self, i: usize) {
        if let GearState::Meshing { power_reversed, .. } = &mut self.gears[i] {
            *power_reversed = !*power_reversed;
        }
    }

    /// Direction in which a row moves, none at rest or without capacity.
    pub fn direction(&self, row: RowId) -> Option<f64> {
        match row {
            RowId::Friction(j) => match self.rows[j] {
                FrictionState::Slipping { sign } => Some(sign),
                _ => None,
            },
            RowId::Gear(i) => match self.gears[i] {
                GearState::Meshing { sign, .. } => Some(sign),
                GearState::Locked => None,
            },
        }
    }
}
