// SPDX-License-Identifier: MIT
//! Hybrid automaton of the driveline: modes, guards, events and Taylor steps between them.

pub(crate) mod active_set;
pub(crate) mod collocation;
mod decision_basis;
pub(crate) mod event;
pub(crate) mod event_search;
mod impulse;
mod loss_cells;
pub(crate) mod mode_cache;
pub(crate) mod stall;
pub(crate) mod state;
pub(crate) mod stick_slip;
pub(crate) mod stiffness;
pub(crate) mod taylor;
pub(crate) mod transition;
pub(crate) mod zero_crossing;
