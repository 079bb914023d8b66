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
use super::trajectory::{Column, Recorder, value};
use crate::model::Driveline;
use crate::network::Network;
use crate::number::{Dual, Number};
use crate::solver::{Settings, Signal, SolverCache, Status};
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
    let settings = Settings { exponential_steps: false, ..settings };
    let options = RunOptions { settings, audit: false };
    let mut plan = Plan::new(&network, &signals, grid, outputs, options)?;
    plan.check_locks(&network, &start)?;
    let inputs = join(&network, &signals, (grid[0], grid[grid.len() - 1]), grid)?;
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
        let (network, grid) = (self.network, &self.plan.grid);
        let columns: Vec<_> =
            self.plan.targets.iter().map(|&target| Column::of(network, target)).collect();
        let mut unused = Recorder::new(network, &[], grid);
        let x = self.plan.begin(network, start);
        let mut run = self.plan.integrator(SolverCache::new(network), x, &start.locked)?;
        self.seed(&mut run.state.x);
        let (mut next, mut entered, mut basis) = (1, true, Vec::new());
        while let Some(step) = run.advance(&mut unused)? {
            if entered {
                run.state.expansion.basis_at(network, Dual::zero_(), &mut basis);
                for (output, column) in columns.iter().enumerate() {
                    let slopes = value(column, &run.state, &basis).eps;
                    self.write_row(found, (next - 1) * columns.len() + output, &slopes);
                }
            }
            let end = (step.start + step.length).re;
            entered = grid.get(next).is_some_and(|&point| end >= point);
            if entered {
                for (state, x) in run.state.x.iter().enumerate() {
                    self.write_step(found, (next - 1) * found.states + state, &x.eps);
                }
                self.seed(&mut run.state.x);
                next += 1;
            }
        }
        Ok(())
    }

    /// Begin the derivatives anew.
    fn seed(&self, x: &mut [Dual<LANES>]) {
        for (state, number) in x.iter_mut().enumerate() {
            *number = variable(self.first, number.re, state);
        }
    }

    fn write_row(&self, found: &mut Response, row: usize, slopes: &[f64]) {
        let states = found.states;
        write(&mut found.rows[row * states..(row + 1) * states], self.first, slopes);
    }

    fn write_step(&self, found: &mut Response, row: usize, slopes: &[f64]) {
        let width = found.states + found.inputs;
        write(&mut found.steps[row * width..(row + 1) * width], self.first, slopes);
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
