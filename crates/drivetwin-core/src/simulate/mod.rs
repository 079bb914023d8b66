// SPDX-License-Identifier: MIT
//! 4 A scenario in, a trajectory out.

mod audit;
mod dual_clutch;
mod run;
mod start;
mod trajectory;

pub use audit::EnergyAudit;
pub use dual_clutch::{simulate_dual_clutch, DualClutchRun, DualClutchStart};
pub use run::{run, SimulateError};
pub use start::{Start, StartError};
pub use trajectory::{Output, Trajectory};
