// SPDX-License-Identifier: MIT
//! Linear response of a run to disturbances of its state and its inputs, through all events.
//!
//! The state carries derivatives by itself, which begin anew at each point of the grid. What they are at the
//! next point is the transition; those by an offset of an input are the effect of that input over the step.

use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError, join};
use super::sensitivity::Scenario;
use super::sets::Case;
use super::start::State;
use super::trajectory::Recorder;
use crate::model::Driveline;
use crate::network::Network;
use crate::number::{Dual, Number};
use crate::solver::{
    Integrator, SampleRange, SampleSink, Samples, Settings, Signal, SolverCache, Status,
};
use std::sync::Arc;

/// Columns of a pass.
const LANES: usize = 8;

/// Response over the steps of a grid of n points, with S states and m inputs.
#[derive(Clone, Debug)]
pub struct Response {
    /// Number of states.
    pub states: usize,
    /// Number of inputs, in the order of the network.
    pub inputs: usize,
    /// Change of the state at the end of a step by that at its start and by inputs that are constant over
    /// it: steps × S × (S + m).
    pub steps: Vec<f64>,
    /// Outputs by the state at the start of each step: steps × outputs × S.
    pub rows: Vec<f64>,
    /// Status at the end of the run.
    pub status: Status,
}

/// Compute the response of a run over `grid` [s].
pub fn respond(
    driveline: &Driveline<f64>,
    scenario: &Scenario<'_>,
    grid: &[f64],
    outputs: &[Output],
    settings: Settings,
) -> Result<Response, SimulateError> {
    let case = Case { driveline: driveline.clone(), start: scenario.start.clone() };
    let (network, start) = case.promote::<Dual<LANES>>().compile()?;
    let signals: Vec<(&str, Signal<'_, Dual<LANES>>)> =
        scenario.signals.iter().map(|(name, signal)| (*name, signal.promote())).collect();
    let options = RunOptions { settings, audit: false };
    let mut plan = Plan::new(&network, &signals, grid, outputs, options)?;
    plan.check_locks(&network, &start)?;
    let inputs = match plan.points {
        Some(_) => (*plan.inputs).clone(),
        None => join(&network, &signals, (grid[0], grid[grid.len() - 1]), grid)?,
    };
    let (states, count) = (network.states(), network.mechanism.inputs.len());
    let steps = grid.len() - 1;
    let mut found = Response {
        states,
        inputs: count,
        steps: vec![f64::NAN; steps * states * (states + count)],
        rows: vec![f64::NAN; steps * outputs.len() * states],
        status: Status::Completed,
    };
    for first in (0..states + count).step_by(LANES) {
        let lift = |input| variable(first, 0.0, states + input);
        plan.inputs = Arc::new(inputs.clone().lift((0..count).map(lift).collect()));
        let pass = Pass { network: &network, plan: &plan, first };
        if let Err(status) = pass.run(&start, &mut found) {
            found.status = status;
            break;
        }
    }
    Ok(found)
}

/// Run for the columns of the response from `first` on.
struct Pass<'a> {
    network: &'a Network<Dual<LANES>>,
    plan: &'a Plan<Dual<LANES>>,
    first: usize,
}

impl Pass<'_> {
    fn run(&self, start: &State<Dual<LANES>>, found: &mut Response) -> Result<(), Status> {
        let (network, first) = (self.network, self.first);
        let x = self.plan.begin(network, start);
        let mut run = self.plan.integrator(SolverCache::new(network), x, &start.locked)?;
        let recorder = Recorder::new(network, &self.plan.targets, &self.plan.grid);
        let mut sink = Renewal { recorder, grid: &self.plan.grid, first, next: 0, found };
        sink.begin_anew(&mut run.state.x);
        while let Some(step) = run.advance(&mut sink)? {
            sink.recorder.sample(&run, &step, run.is_at_end());
            sink.reach((step.start + step.length).re, &mut run.state.x);
        }
        let Renewal { recorder, .. } = sink;
        let (_, rows) = recorder.finish();
        for (output, rows) in rows.iter().enumerate() {
            for (k, slopes) in rows[..rows.len() - 1].iter().enumerate() {
                let (states, row) = (found.states, k * self.plan.targets.len() + output);
                write(&mut found.rows[row * states..(row + 1) * states], first, slopes);
            }
        }
        Ok(())
    }
}

/// Records outputs; at each point of the grid it stores the derivatives of the state and begins them anew.
struct Renewal<'r, 'g> {
    recorder: Recorder<'g, Dual<LANES>>,
    grid: &'g [f64],
    first: usize,
    /// Next point of the grid.
    next: usize,
    found: &'r mut Response,
}

impl Renewal<'_, '_> {
    /// Store the step that ends at a point of the grid, if `time` [s] is one.
    fn reach(&mut self, time: f64, x: &mut [Dual<LANES>]) {
        if self.grid.get(self.next).is_none_or(|&point| time < point) {
            return;
        }
        let width = self.found.states + self.found.inputs;
        for (state, number) in x.iter().enumerate() {
            let row = (self.next - 1) * self.found.states + state;
            write(&mut self.found.steps[row * width..(row + 1) * width], self.first, &number.eps);
        }
        self.begin_anew(x);
    }

    /// Begin the derivatives anew.
    fn begin_anew(&mut self, x: &mut [Dual<LANES>]) {
        for (state, number) in x.iter_mut().enumerate() {
            *number = variable(self.first, number.re, state);
        }
        self.next += 1;
    }
}

impl SampleSink<Dual<LANES>> for Renewal<'_, '_> {
    const SAMPLES: usize = 1;

    fn write_block(
        &mut self,
        run: &Integrator<'_, Dual<LANES>>,
        active: &[usize],
        samples: Samples<'_, Dual<LANES>>,
        range: SampleRange,
    ) {
        self.recorder.write_block(run, active, samples, range);
    }

    fn renew(&mut self, time: f64, x: &mut [Dual<LANES>]) {
        self.reach(time, x);
    }
}

/// The variable of a column of the response in the pass from column `first` on; a number in another.
fn variable(first: usize, value: f64, column: usize) -> Dual<LANES> {
    match column.checked_sub(first) {
        Some(lane) if lane < LANES => Dual::variable(value, lane),
        _ => Dual::of(value),
    }
}

/// Write `values` from entry `first` of a row on, as many as it has.
fn write(row: &mut [f64], first: usize, values: &[f64]) {
    let rest = row.get_mut(first..).unwrap_or_default();
    rest.iter_mut().zip(values).for_each(|(to, value)| *to = *value);
}
