// SPDX-License-Identifier: MIT
//! 4 A scenario in, a trajectory out.

mod audit;
mod dual_clutch;
mod run;
mod sensitivity;
mod start;
mod trajectory;

pub use audit::EnergyAudit;
pub use dual_clutch::{DualClutchRun, DualClutchStart, simulate_dual_clutch};
pub use run::{Plan, SimulateError, run};
pub use sensitivity::{Sampled, Sensitivities, SensitivityError, dual_clutch_sensitivities};
pub use start::{Start, StartError, State};
pub use trajectory::{Output, Trajectory};
