// SPDX-License-Identifier: MIT
//! Many controlled runs: parameter sets of a driveline, each with its own actuators, under several controllers.

use super::batch::{Batch, Outcome, Sets, check_names, last_lock};
use super::controlled_run::{ControlledRun, INPUTS, Tasks, run_controlled};
use super::dual_clutch::DualClutchStart;
use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError};
use super::sensitivity::SensitivityError;
use super::threads::share_out;
use crate::control::{ControlledUnit, ShiftController};
use crate::model::dual_clutch::{DualClutch, ENGINE_TORQUE};
use crate::network::Network;
use crate::solver::{Settings, Signal, SolverCache, Status};

/// Controlled runs of a batch: all controllers for every parameter set with its unit.
#[derive(Clone, Copy, Debug)]
pub struct ControlledRuns<'c> {
    /// Controllers of one task, from one request on.
    pub controllers: &'c [ShiftController],
    /// Actuators of every set.
    pub units: &'c [ControlledUnit],
    /// Names of the parameters.
    pub parameters: &'c [&'c str],
    /// Sets × parameters.
    pub sets: &'c [f64],
    /// Time grid, s.
    pub grid: &'c [f64],
    /// Recorded outputs.
    pub outputs: &'c [Output],
    /// True if the inputs and commands are recorded behind the outputs.
    pub with_inputs: bool,
}

impl ControlledRuns<'_> {
    /// Numbers kept of one run.
    pub fn size(&self) -> usize {
        let inputs = if self.with_inputs { INPUTS } else { 0 };
        (self.outputs.len() + inputs) * self.grid.len()
    }

    /// Plan over the grid, with inputs that count for their knots alone.
    fn plan(&self, network: &Network<f64>) -> Result<Plan<f64>, SimulateError> {
        let nothing = vec![0.0; self.grid.len()];
        let first = &self.controllers[0];
        let signals = [ENGINE_TORQUE, &first.offgoing, &first.oncoming]
            .map(|name| (name, Signal::samples(self.grid, &nothing)));
        let options = RunOptions { settings: Settings::default(), audit: false };
        Plan::new(network, &signals, self.grid, self.outputs, options)
    }
}

/// A parameter set with all its runs.
struct Job<'v> {
    set: usize,
    /// Controllers × kept numbers.
    values: &'v mut [f64],
    /// Outcome, number of events and last lock [s] of each run.
    ends: Vec<(Outcome, u32, f64)>,
}

/// Simulate a dual-clutch driveline under controllers. The numbers kept of each run ([`ControlledRuns::size`])
/// overwrite `values`, sets × controllers. Failed runs give NaN.
///
/// # Panics
///
/// If `values` is not as long as what is kept of all runs, or there is no controller.
pub fn controlled_batch(
    model: &DualClutch<f64>,
    start: &DualClutchStart<f64>,
    runs: ControlledRuns<'_>,
    threads: usize,
    values: &mut [f64],
) -> Result<Batch, SensitivityError> {
    check_names(model, start, runs.parameters, runs.sets)?;
    let network = Network::compile(&model.driveline()).map_err(SimulateError::from)?;
    let plan = runs.plan(&network)?;
    let first = &runs.controllers[0];
    let tasks = Tasks::new(&network, &plan.inputs, first).ok_or_else(|| {
        SensitivityError::Unknown { name: format!("{} or {}", first.offgoing, first.oncoming) }
    })?;
    let (size, count) = (runs.size(), runs.controllers.len());
    assert_eq!(values.len(), runs.units.len() * count * size, "places for what is kept");
    let chunks = values.chunks_exact_mut(count * size).enumerate();
    let job = |(set, values)| Job { set, values, ends: Vec::with_capacity(count) };
    let mut jobs: Vec<Job<'_>> = chunks.map(job).collect();
    let sets = Sets { model, starts: vec![start], parameters: runs.parameters, sets: runs.sets };
    share_out(threads, jobs.iter_mut(), |job| run_set(&sets, &plan, &tasks, &runs, job));
    let mut result = Batch::default();
    for mut job in jobs {
        job.ends.resize(count, (Outcome::Refused(SimulateError::Interrupted), 0, f64::NAN));
        for (outcome, events, lock) in job.ends {
            result.outcomes.push(outcome);
            result.events.push(events);
            result.last_lock.push(lock);
        }
    }
    Ok(result)
}

/// Do all runs of a set, which share modes and propagators.
fn run_set(
    sets: &Sets<'_>,
    plan: &Plan<f64>,
    tasks: &Tasks,
    runs: &ControlledRuns<'_>,
    job: &mut Job<'_>,
) {
    job.values.fill(f64::NAN);
    let prepared = sets.compile_runs(&[job.set]);
    let (network, state) = match prepared.and_then(|p| plan.check(&p.0).map(|()| p)) {
        Ok(prepared) => prepared,
        Err(error) => {
            let refused = (Outcome::Refused(error), 0, f64::NAN);
            job.ends.resize(runs.controllers.len(), refused);
            return;
        }
    };
    let mut cache = SolverCache::new(&network);
    let unit = &runs.units[job.set];
    for (given, values) in runs.controllers.iter().zip(job.values.chunks_exact_mut(runs.size())) {
        let run = run_controlled(plan, tasks, &mut cache, &state, given, unit);
        let ControlledRun { columns, inputs, events, status } = run;
        if status == Status::Completed {
            let kept = if runs.with_inputs { &inputs[..] } else { &[] };
            let all = columns.iter().chain(kept);
            for (to, column) in values.chunks_exact_mut(runs.grid.len()).zip(all) {
                to.copy_from_slice(column);
            }
        }
        let lock = last_lock(&events).unwrap_or(f64::NAN);
        job.ends.push((Outcome::Ran(status), events.len() as u32, lock));
    }
}
