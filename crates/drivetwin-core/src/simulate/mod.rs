// SPDX-License-Identifier: MIT
//! 4 A scenario in, a trajectory out.

mod abreast;
mod audit;
mod batch;
mod batch_sensitivity;
mod dual_clutch;
mod linear;
mod recorded;
mod run;
mod sensitivity;
mod start;
mod threads;
mod trajectory;

pub use audit::EnergyAudit;
pub use batch::{Batch, Keep, Outcome, dual_clutch_batch};
pub use batch_sensitivity::{BatchDerivatives, Stated, dual_clutch_batch_sensitivities};
pub use dual_clutch::{
    DualClutchRun, DualClutchStart, dual_clutch_outputs, run_dual_clutch, simulate_dual_clutch,
};
pub use linear::{Linear, Slipping, linearise};
pub use run::{Plan, SimulateError, run, run_network};
pub use sensitivity::{Sampled, Sensitivities, SensitivityError, dual_clutch_sensitivities};
pub use start::{Start, StartError, State};
pub use trajectory::{Output, Trajectory};
