// SPDX-License-Identifier: MIT
//! One run of a network over a time grid.

use super::audit::Auditor;
use super::start::{Start, StartError};
use super::trajectory::{Output, Recorder, Trajectory};
use crate::network::{CompileError, Network};
use crate::number::Real;
use crate::solve::{InputError, Inputs, Integrator, Settings, Signal, Status};
use thiserror::Error;

/// Why a scenario cannot be run at all.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SimulateError {
    /// The driveline.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The inputs.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The start or the outputs.
    #[error(transparent)]
    Start(#[from] StartError),
    /// The grid.
    #[error("the time grid must be finite and increase, with at least two points (point {index})")]
    Grid {
        /// First offending point.
        index: usize,
    },
}

/// Simulate over `grid` [s] and record `outputs` on it. Signals go by the names of the inputs.
/// A run that fails on the way ends with its status and NaN from there on.
pub fn run<T: Real>(
    network: &Network<T>,
    signals: &[(&str, Signal<'_, T>)],
    start: &Start<T>,
    grid: &[f64],
    outputs: &[Output],
    (settings, audit): (Settings, bool),
) -> Result<Trajectory<T>, SimulateError> {
    check_grid(grid)?;
    let span = (grid[0], grid[grid.len() - 1]);
    let inputs = join(network, signals, span)?;
    let (x, locked) = start.state(network)?;
    let mut recorder = Recorder::new(network, outputs, grid)?;
    let mut events = Vec::new();
    let mut balance = None;
    // Between samples only the expansion knows the motion.
    let dense = audit || recorder.needs_motion() || !inputs.has_knots(grid);
    let settings = Settings { sprint: settings.sprint && !dense, ..settings };
    let mut integrate = || -> Result<(), Status> {
        let mut run = Integrator::start(network, &inputs, settings, x.clone(), &locked)?;
        let mut auditor = audit.then(|| Auditor::new(network, &run.x));
        let end = loop {
            let mut passed = |time: f64, basis: &[T], run: &Integrator<'_, T>| {
                recorder.sample_basis(time, basis, run);
            };
            match run.advance(&mut passed) {
                Ok(Some(step)) => {
                    let last = (step.start + step.length).re() >= span.1;
                    recorder.sample(&run, &step, last);
                    if let Some(auditor) = &mut auditor {
                        auditor.add(&run, &step);
                    }
                }
                Ok(None) => break Ok(()),
                Err(status) => break Err(status),
            }
        };
        balance = auditor.map(|auditor| auditor.close(network, &run.x));
        events = std::mem::take(&mut run.events);
        end
    };
    let status = integrate().err().unwrap_or(Status::Completed);
    let columns = recorder.finish();
    let frictions = network.frictions.iter().map(|row| row.element.clone());
    let elements =
        frictions.chain(network.losses.iter().map(|gear| gear.element.clone())).collect();
    let time = grid.to_vec();
    Ok(Trajectory { time, columns, elements, events, status, audit: balance })
}

/// The signals in the order in which the network numbers its inputs.
fn join<T: Real>(
    network: &Network<T>,
    signals: &[(&str, Signal<'_, T>)],
    span: (f64, f64),
) -> Result<Inputs<T>, InputError> {
    let ordered = network
        .mechanism
        .inputs
        .iter()
        .map(|name| {
            let found = signals.iter().find(|signal| signal.0 == name);
            found.copied().ok_or_else(|| InputError::Missing { name: name.clone() })
        })
        .collect::<Result<Vec<_>, _>>()?;
    for prescribed in &network.mechanism.prescribed {
        refuse_jump(ordered[prescribed.input])?;
    }
    Inputs::join(&ordered, span)
}

fn check_grid(grid: &[f64]) -> Result<(), SimulateError> {
    let ordered = |i: usize| grid[i].is_finite() && (i == 0 || grid[i] > grid[i - 1]);
    match (0..grid.len()).find(|&i| !ordered(i)) {
        Some(index) => Err(SimulateError::Grid { index }),
        None if grid.len() < 2 => Err(SimulateError::Grid { index: 0 }),
        None => Ok(()),
    }
}

/// A prescribed speed that jumps would take an infinite torque.
fn refuse_jump<T: Real>((name, signal): (&str, Signal<'_, T>)) -> Result<(), InputError> {
    let Signal::Samples { times, .. } = signal else { return Ok(()) };
    match times.windows(2).position(|w| w[0] == w[1]) {
        Some(i) => Err(InputError::Jump { name: name.to_owned(), time: times[i] }),
        None => Ok(()),
    }
}
