// SPDX-License-Identifier: MIT
//! One run of a driveline whose inputs a controller determines task by task.

use super::run::Plan;
use super::start::{StartError, State, find};
use super::trajectory::Recorder;
use crate::control::{Commands, ControlledUnit, Controller, Drive, Measured, Slips};
use crate::model::mechanism::Normal;
use crate::network::Network;
use crate::network::nonlinear_torque::form;
use crate::solver::{Event, Inputs, Integrator, SolverCache, Status};
use std::sync::Arc;

/// Number of recorded inputs: engine torque, pressures of both elements, then their commands, which have held
/// until the sample.
pub(super) const INPUTS: usize = 6;

/// Knots at which the tasks of a controller begin, and the last of all.
pub(super) struct Tasks(Vec<usize>);

/// Result of a controlled run.
pub(super) struct ControlledRun {
    pub columns: Vec<Vec<f64>>,
    /// Inputs and commands on the grid, see [`INPUTS`].
    pub inputs: Vec<Vec<f64>>,
    pub events: Vec<Event<f64>>,
    pub status: Status,
}

/// Names of the quantities of a network that a controller commands and measures.
#[derive(Clone, Copy, Debug)]
pub struct Wiring<'c> {
    /// Off-going and on-coming element.
    pub elements: [&'c str; 2],
    /// Input that is the engine torque.
    pub engine_torque: &'c str,
    /// Nodes of the engine and of the gearbox output, whose speeds are measured.
    pub speeds: Option<[&'c str; 2]>,
}

/// Places of the controlled quantities in a network.
#[derive(Clone, Copy)]
pub(super) struct Places {
    /// Friction elements: off-going, on-coming.
    frictions: [usize; 2],
    /// Inputs: engine torque, off-going, on-coming.
    pub inputs: [usize; 3],
    /// Nodes: engine, gearbox output.
    nodes: Option<[usize; 2]>,
}

impl Tasks {
    /// Tasks of this duration [s] from the first knot on; a task begins at the knot nearest to its time.
    pub fn new(inputs: &Inputs<f64>, duration: f64) -> Self {
        let knots = inputs.knots();
        let last = knots.len() - 1;
        let mut first = vec![0];
        for (i, knot) in knots.iter().enumerate().skip(1) {
            let due = knots[0] + duration * first.len() as f64;
            if i == last || *knot >= due - 0.5 * (knots[i + 1] - knot) {
                first.push(i);
            }
        }
        Self(first)
    }
}

impl Places {
    /// Find the elements, their pressures, the engine torque and the measured nodes.
    pub fn find(network: &Network<f64>, wiring: &Wiring<'_>) -> Result<Self, StartError> {
        let pressed =
            network.frictions.iter().enumerate().filter_map(|(j, row)| match row.normal {
                Normal::Pressure { input, .. } => Some((j, input, &row.element)),
                Normal::Constant(_) => None,
            });
        let pressed: Vec<_> = pressed.collect();
        let clutch = |name| find("clutch", name, pressed.iter().map(|one| one.2));
        let (off, on) = (clutch(wiring.elements[0])?, clutch(wiring.elements[1])?);
        let torque = find("input", wiring.engine_torque, network.mechanism.inputs.iter())?;
        let node = |name| find("node", name, network.mechanism.nodes.iter());
        let nodes = match wiring.speeds {
            Some([engine, output]) => Some([node(engine)?, node(output)?]),
            None => None,
        };
        Ok(Self {
            frictions: [pressed[off].0, pressed[on].0],
            inputs: [torque, pressed[off].1, pressed[on].1],
            nodes,
        })
    }

    fn measure(&self, network: &Network<f64>, x: &[f64]) -> Measured {
        let slip = |place: usize| form(&network.frictions[self.frictions[place]].slip, x);
        let speed = |place: usize| {
            self.nodes.map_or(f64::NAN, |nodes| {
                form(&network.express_in_speeds(&[(nodes[place], 1.0)]), x)
            })
        };
        Measured {
            slips: Slips { offgoing: slip(0), oncoming: slip(1) },
            engine_speed: speed(0),
            output_speed: speed(1),
        }
    }
}

/// Inputs of one task over its knots, and of all on the grid.
struct InputTrace<'p> {
    plan: &'p Plan<f64>,
    places: Places,
    /// Number of inputs of the network.
    width: usize,
    /// Of the task, knots × inputs.
    values: Vec<f64>,
    grid: Vec<Vec<f64>>,
    next: usize,
}

impl InputTrace<'_> {
    /// Let the drive pass a task from its first to its last knot.
    fn pass_task(&mut self, drive: &mut Drive<'_>, commands: Commands, first: usize, last: usize) {
        self.values.clear();
        self.note(drive.inputs(), commands, first);
        for knot in first + 1..=last {
            let inputs = drive.advance(self.plan.inputs.knot(knot));
            self.note(inputs, commands, knot);
        }
    }

    fn note(&mut self, inputs: Commands, commands: Commands, knot: usize) {
        let [torque, off, on] = self.places.inputs;
        let at = self.values.len();
        self.values.extend((0..self.width).map(|input| self.plan.inputs.knot_value(knot, input)));
        self.values[at + torque] = inputs.engine_torque;
        self.values[at + off] = inputs.offgoing;
        self.values[at + on] = inputs.oncoming;
        if self.plan.grid.get(self.next) == Some(&self.plan.inputs.knot(knot)) {
            self.next += 1;
            let both = [inputs, commands];
            let all = both.iter().flat_map(|one| [one.engine_torque, one.offgoing, one.oncoming]);
            self.grid.iter_mut().zip(all).for_each(|(column, value)| column.push(value));
        }
    }
}

/// Run a plan with the inputs of a controller at their places.
pub(super) fn run_controlled<'n>(
    plan: &Plan<f64>,
    tasks: &Tasks,
    places: Places,
    known: &mut SolverCache<'n, f64>,
    start: &State<f64>,
    given: &dyn Controller,
    unit: &ControlledUnit,
) -> ControlledRun {
    let network = known.network;
    let width = network.mechanism.inputs.len();
    let grid = (0..INPUTS).map(|_| Vec::with_capacity(plan.grid.len())).collect::<Vec<_>>();
    let mut trace = InputTrace { plan, places, width, values: Vec::new(), grid, next: 0 };
    let (begin, step) = (plan.inputs.knot(0), plan.inputs.knot(1) - plan.inputs.knot(0));
    let mut drive = Drive::new(given, unit, begin, step);
    let mut recorder = Recorder::new(network, &plan.targets, &plan.grid);
    let mut events = Vec::new();
    let mut integrate = || -> Result<(), Status> {
        let x = plan.begin(network, start);
        let measured = trace.places.measure(network, &x);
        let (first, last) = (tasks.0[0], tasks.0[1]);
        let mut inputs = Inputs::part_of(&plan.inputs, first, last);
        let commands = command(&mut drive, begin, &measured)?;
        trace.pass_task(&mut drive, commands, first, last);
        inputs.rewrite(&plan.inputs, first, last, &trace.values);
        let cache = std::mem::replace(known, SolverCache::new(network));
        let inputs = Arc::new(inputs);
        let mut run = Integrator::start(cache, inputs, plan.settings, x, &start.locked)?;
        let outcome = pass_tasks(&mut run, &mut recorder, tasks, &mut trace, &mut drive);
        events = std::mem::take(&mut run.state.events);
        *known = run.into_cache();
        outcome.and_then(|()| recorder.check_complete())
    };
    let status = integrate().err().unwrap_or(Status::Completed);
    let (columns, _) = recorder.finish();
    for column in &mut trace.grid {
        column.resize(plan.grid.len(), f64::NAN);
    }
    ControlledRun { columns, inputs: trace.grid, events, status }
}

/// Let the drive command at a task at a time [s]; fails where a command is not finite.
fn command(drive: &mut Drive<'_>, time: f64, measured: &Measured) -> Result<Commands, Status> {
    let commands = drive.command(measured);
    if commands.are_finite() {
        Ok(commands)
    } else {
        Err(Status::CommandNotFinite { time, measured: measured.to_string() })
    }
}

/// Run to the end of the first task, and through all others.
fn pass_tasks(
    run: &mut Integrator<'_, f64>,
    recorder: &mut Recorder<'_, f64>,
    tasks: &Tasks,
    trace: &mut InputTrace<'_>,
    drive: &mut Drive<'_>,
) -> Result<(), Status> {
    recorder.run_to_end(run)?;
    for span in tasks.0.windows(2).skip(1) {
        let measured = trace.places.measure(run.state.network, &run.state.x);
        let commands = command(drive, trace.plan.inputs.knot(span[0]), &measured)?;
        trace.pass_task(drive, commands, span[0], span[1]);
        run.continue_with(|inputs| {
            inputs.rewrite(&trace.plan.inputs, span[0], span[1], &trace.values);
        });
        recorder.run_to_end(run)?;
    }
    Ok(())
}
