// SPDX-License-Identifier: MIT
//! 4 A scenario in, a trajectory out.

mod batch;
mod batch_sensitivity;
mod controlled_batch;
mod controlled_run;
mod element_power;
mod energy_balance;
mod linear;
mod lockstep_recorder;
mod output;
mod output_buffer;
mod response;
mod run;
mod sensitivity;
mod sets;
mod start;
mod threads;
mod trajectory;

pub use batch::{Batch, Keep, Outcome, batch};
pub use batch_sensitivity::{BatchDerivatives, Recording, batch_sensitivities};
pub use controlled_batch::{ControlledRuns, controlled_batch};
pub use controlled_run::Wiring;
pub use energy_balance::EnergyAudit;
pub use linear::{Linear, Slipping, linearise};
pub use output::Output;
pub use response::{Response, respond};
pub use run::{Plan, RunOptions, SimulateError, run, run_network};
pub use sensitivity::{
    Differentiation, LANES, Scenario, Seed, Sensitivities, SensitivityError, Unknowns,
};
pub use sets::ParameterSets;
pub use start::{Start, StartError, State};
pub use trajectory::Trajectory;
