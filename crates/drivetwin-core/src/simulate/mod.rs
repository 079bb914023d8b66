// SPDX-License-Identifier: MIT
//! 4 A scenario in, a trajectory out.

mod batch;
mod batch_sensitivity;
mod controlled_batch;
mod controlled_run;
mod dual_clutch;
mod element_power;
mod energy_balance;
mod linear;
mod lockstep_recorder;
mod output;
mod output_buffer;
mod run;
mod sensitivity;
mod start;
mod threads;
mod trajectory;

pub use batch::{Batch, Keep, Outcome, dual_clutch_batch};
pub use batch_sensitivity::{
    BatchDerivatives, ParameterSets, Recording, Stated, dual_clutch_batch_sensitivities,
};
pub use controlled_batch::{ControlledRuns, controlled_batch};
pub use dual_clutch::{
    DualClutchRun, DualClutchStart, dual_clutch_outputs, run_dual_clutch, simulate_dual_clutch,
};
pub use energy_balance::EnergyAudit;
pub use linear::{Linear, Slipping, linearise};
pub use output::Output;
pub use run::{Plan, RunOptions, SimulateError, run, run_network};
pub use sensitivity::{LANES, Sampled, Sensitivities, SensitivityError, dual_clutch_sensitivities};
pub use start::{Start, StartError, State};
pub use trajectory::Trajectory;
