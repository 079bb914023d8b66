// SPDX-License-Identifier: MIT
//! 3 The hybrid integrator. It sees rows, capacities and modes, and no element.
//!
//! Per mode the motion is analytic between input samples, so a step is a Taylor expansion in time
//! of the whole state; guards are polynomials of the same expansion and their first roots are the
//! events. Who stays stuck is decided by the box-constrained programme of THEORY section 1.

mod assignment;
mod decide;
mod expansion;
mod first_fall;
mod formation;
mod guard;
mod input_error;
mod inputs;
mod integrals;
mod integrator;
mod known;
mod lanes;
mod march;
mod operators;
mod passage;
mod progress;
mod ready;
mod regime;
mod sprint;
mod status;
mod step;
mod transition;
mod watch;

pub use expansion::Expansion;
pub use formation::{Lanes, Record, WIDTH, bits, run_together};
pub use input_error::InputError;
pub use inputs::{Inputs, NO_POINT, Signal};
pub use integrator::{Integrator, Settings, Step};
pub use known::Known;
pub(crate) use lanes::{Task, dispatch};
pub use march::{BLOCK, Samples};
pub use operators::MAX_SLIPPING;
pub use passage::Stretch;
pub use ready::can_march;
pub use regime::{Event, EventKind, Regime, RowState};
pub use sprint::Sink;
pub use status::Status;
