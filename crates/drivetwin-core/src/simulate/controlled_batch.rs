// SPDX-License-Identifier: MIT
//! Many controlled runs: parameter sets of a driveline, each with its own actuators, under several controllers.

use super::batch::{Batch, Outcome, last_lock};
use super::controlled_run::{ControlledRun, INPUTS, Places, Tasks, Wiring, run_controlled};
use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError};
use super::sensitivity::{Scenario, SensitivityError};
use super::sets::{ParameterSets, Sets};
use super::threads::share_out;
use crate::control::{ControlledUnit, Controller};
use crate::model::Driveline;
use crate::network::Network;
use crate::solver::{Settings, Signal, SolverCache, Status};

/// Controlled runs of a batch: all controllers for every parameter set with its unit.
#[derive(Clone, Copy, Debug)]
pub struct ControlledRuns<'c> {
    /// Controllers of one task, from one request on.
    pub controllers: &'c [&'c dyn Controller],
    /// Time between two commands, s.
    pub task: f64,
    /// Actuators of every set.
    pub units: &'c [ControlledUnit],
    /// Quantities that they command and measure.
    pub wiring: Wiring<'c>,
    /// Parameter sets of the driveline.
    pub parameters: ParameterSets<'c>,
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

    fn find_places(&self, network: &Network<f64>) -> Result<Places, SimulateError> {
        Ok(Places::find(network, &self.wiring)?)
    }

    /// Plan over the grid; the controlled inputs count for their knots alone.
    fn plan(
        &self,
        network: &Network<f64>,
        signals: &[(&str, Signal<'_, f64>)],
    ) -> Result<Plan<f64>, SimulateError> {
        let nothing = vec![0.0; self.grid.len()];
        let inputs = self.find_places(network)?.inputs;
        let names = inputs.map(|input| network.mechanism.inputs[input].as_str());
        let controlled = names.map(|name| (name, Signal::samples(self.grid, &nothing)));
        let signals = [&controlled, signals].concat();
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

/// Simulate a driveline under controllers. The scenario has the start, and the inputs that are not controlled,
/// as samples without jumps. The numbers kept of each run ([`ControlledRuns::size`]) overwrite `values`, sets ×
/// controllers. Failed runs give NaN.
///
/// # Panics
///
/// If `values` is not as long as what is kept of all runs, or there is no controller.
pub fn controlled_batch(
    driveline: &Driveline<f64>,
    scenario: &Scenario<'_>,
    runs: ControlledRuns<'_>,
    threads: usize,
    values: &mut [f64],
) -> Result<Batch, SensitivityError> {
    let sets = Sets::new(driveline, vec![&scenario.start], runs.parameters)?;
    let network = Network::compile(driveline).map_err(SimulateError::from)?;
    let plan = runs.plan(&network, &scenario.signals)?;
    let tasks = Tasks::new(&plan.inputs, runs.task);
    let (size, count) = (runs.size(), runs.controllers.len());
    assert_eq!(values.len(), runs.units.len() * count * size, "places for what is kept");
    let chunks = values.chunks_exact_mut(count * size).enumerate();
    let job = |(set, values)| Job { set, values, ends: Vec::with_capacity(count) };
    let mut jobs: Vec<Job<'_>> = chunks.map(job).collect();
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
    let refuse = |job: &mut Job<'_>, error| {
        job.ends.resize(runs.controllers.len(), (Outcome::Refused(error), 0, f64::NAN));
    };
    let (network, state) = match sets.place_runs(&[job.set]).compile() {
        Ok(prepared) => prepared,
        Err(error) => return refuse(job, error),
    };
    let found = plan.adapt(&network, &state).and_then(|p| Ok((p, runs.find_places(&network)?)));
    let (plan, places) = match found {
        Ok(found) => found,
        Err(error) => return refuse(job, error),
    };
    let mut cache = SolverCache::new(&network);
    let unit = &runs.units[job.set];
    for (given, values) in runs.controllers.iter().zip(job.values.chunks_exact_mut(runs.size())) {
        let run = run_controlled(&plan, tasks, places, &mut cache, &state, *given, unit);
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
