// SPDX-License-Identifier: MIT
//! One run of a network over a time grid.

use super::energy_balance::{BalanceScale, EnergyBalance};
use super::output::{Output, Target};
use super::start::{Start, StartError, State};
use super::trajectory::{Recorder, Trajectory};
use crate::model::Name;
use crate::network::{CompileError, Mode, ModeKey, Network};
use crate::number::{Number, Real};
use crate::solver::{
    InputError, Inputs, Integrator, MAX_SPECTRAL_STEP_SLIPPING, Settings, Signal, SolverCache,
    Status, supports_fixed_step, supports_lockstep,
};
use std::borrow::Cow;
use std::sync::Arc;
use thiserror::Error;

/// Reason why a scenario cannot be run at all.
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
    /// Efficiencies that leave the motion undetermined.
    #[error(
        "a gear of the driveline is self-locking: its efficiency leaves the motion undetermined"
    )]
    Undetermined,
    /// The caller asked for the end before the run had begun.
    #[error("interrupted")]
    Interrupted,
    /// The grid.
    #[error("the time grid must be finite and increase, with at least two points (point {index})")]
    Grid {
        /// First offending point.
        index: usize,
    },
}

/// How a run is computed and what is computed beside its outputs.
#[derive(Clone, Copy, Debug, Default)]
pub struct RunOptions {
    /// Accuracy.
    pub settings: Settings,
    /// True if the energy balance is computed.
    pub audit: bool,
}

/// A scenario made ready for a network and all others of its structure: inputs on common knots,
/// outputs found by name.
#[derive(Clone, Debug)]
pub struct Plan<T> {
    pub(super) inputs: Arc<Inputs<T>>,
    pub(super) grid: Vec<f64>,
    /// Point of the grid at every knot, see [`Inputs::points`].
    pub(super) points: Option<Vec<usize>>,
    outputs: Vec<Output>,
    /// These, in their order.
    pub(super) targets: Vec<Target>,
    pub(super) settings: Settings,
    audit: bool,
    /// True if several runs can go side by side.
    pub(super) lockstep: bool,
}

impl<T: Real> Plan<T> {
    /// For runs over `grid` [s] that record `outputs` on it. Signals go by the names of the inputs.
    pub fn new(
        network: &Network<T>,
        signals: &[(&str, Signal<'_, T>)],
        grid: &[f64],
        outputs: &[Output],
        options: RunOptions,
    ) -> Result<Self, SimulateError> {
        let RunOptions { settings, audit } = options;
        check_grid(grid)?;
        let find = |output: &Output| output.find(network);
        let targets = outputs.iter().map(find).collect::<Result<Vec<_>, _>>()?;
        let motion = |target: &Target| target.needs_expansion(network);
        let sprint = settings.exponential_steps && !audit && !targets.iter().any(motion);
        let sampled =
            |(_, signal): &(_, _)| !T::DERIVATIVES || matches!(signal, Signal::Samples { .. });
        let fine = sprint && supports_fixed_step(network) && signals.iter().all(sampled);
        let span = (grid[0], grid[grid.len() - 1]);
        let inputs = join(network, signals, span, if fine { grid } else { &[] })?;
        let slips = !network.channels.is_empty();
        let inputs = if fine && slips { divided(network, inputs) } else { inputs };
        let points = inputs.points(grid);
        let settings = Settings { exponential_steps: sprint && points.is_some(), ..settings };
        let together = supports_lockstep(network) && signals.iter().all(sampled);
        let lockstep = together && settings.exponential_steps && inputs.is_sampled();
        let (grid, outputs) = (grid.to_vec(), outputs.to_vec());
        let inputs = Arc::new(inputs);
        Ok(Self { inputs, grid, points, outputs, targets, settings, audit, lockstep })
    }

    /// Find the outputs in a network with other values. These decide which elements hold: a road load without
    /// rolling resistance holds nothing.
    pub(super) fn find_targets<N: Number>(
        &self,
        network: &Network<N>,
    ) -> Result<Vec<Target>, SimulateError> {
        let found = self.outputs.iter().map(|output| output.find(network));
        Ok(found.collect::<Result<_, _>>()?)
    }

    /// Refuse locked elements that the prescribed speeds contradict.
    pub(super) fn check_locks(
        &self,
        network: &Network<T>,
        start: &State<T>,
    ) -> Result<(), StartError> {
        let first = |&(_, input): &(_, usize)| self.inputs.start_value(input);
        start.check_locks(network, &network.prescribed.iter().map(first).collect::<Vec<_>>())
    }

    /// Prepare the plan for a network with other values and its start.
    pub(super) fn adapt(
        &self,
        network: &Network<T>,
        start: &State<T>,
    ) -> Result<Cow<'_, Self>, SimulateError> {
        self.check_locks(network, start)?;
        let targets = self.find_targets(network)?;
        let same = targets == self.targets;
        let other = || Self { targets, ..self.clone() };
        Ok(if same { Cow::Borrowed(self) } else { Cow::Owned(other()) })
    }

    pub(super) fn integrator<'r>(
        &'r self,
        known: SolverCache<'r, T>,
        x: Vec<T>,
        locked: &[usize],
    ) -> Result<Integrator<'r, T>, Status> {
        Integrator::start(known, Arc::clone(&self.inputs), self.settings, x, locked)
    }

    /// State at the start, with the prescribed speeds that it is left to.
    pub(super) fn begin(&self, network: &Network<T>, start: &State<T>) -> Vec<T> {
        let mut x = start.x.clone();
        for (k, &(_, input)) in network.prescribed.iter().enumerate() {
            let speed = self.inputs.start_value(input);
            for i in 0..start.driven.rows {
                x[i] += start.driven[(i, k)] * speed;
            }
        }
        x
    }

    /// Refuse an energy balance that does not close to the accuracy of the run.
    fn check_audit(&self, time: f64, error: f64, scale: BalanceScale) -> Result<(), Status> {
        let energy = scale.largest;
        if self.settings.order.is_some() {
            return Ok(());
        }
        if !error.is_finite() || !energy.is_finite() {
            return Err(Status::NotFinite { time });
        }
        match error.abs() <= self.settings.audit_tolerance(energy, scale.unresolved) {
            true => Ok(()),
            false => Err(Status::OpenBalance { time, error, energy }),
        }
    }

    /// One run. If it fails on the way it ends with its status, and with NaN from there on.
    pub fn run(&self, network: &Network<T>, start: &State<T>) -> Trajectory<T> {
        self.run_again(&mut SolverCache::new(network), start)
    }

    /// Run with the modes and propagators that earlier runs have compiled.
    pub fn run_again<'r>(
        &'r self,
        known: &mut SolverCache<'r, T>,
        start: &State<T>,
    ) -> Trajectory<T> {
        let network = known.network;
        let mut recorder = Recorder::new(network, &self.targets, &self.grid);
        let mut events = Vec::new();
        let (mut balance, mut grazing) = (None, None);
        let mut integrate = || -> Result<(), Status> {
            let x = self.begin(network, start);
            let cache = std::mem::replace(known, SolverCache::new(network));
            let mut run = self.integrator(cache, x.clone(), &start.locked)?;
            let outcome = if self.audit {
                let mut auditor = EnergyBalance::new(network, &x, self.settings.speed_resolution());
                let outcome =
                    recorder.run_to_end_with(&mut run, |run, step| auditor.add(run, step));
                let (audit, scale) = auditor.close(&run.state);
                balance = Some(audit);
                outcome.and_then(|()| self.check_audit(run.time().re(), audit.error, scale))
            } else {
                recorder.run_to_end(&mut run)
            };
            events = std::mem::take(&mut run.state.events);
            grazing = run.grazing.take();
            *known = run.into_cache();
            outcome.and_then(|()| recorder.check_complete())
        };
        let status = integrate().err().unwrap_or(Status::Completed);
        let frictions = network.frictions.iter().map(|row| &row.element);
        let gears = network.losses.iter().map(|gear| &gear.element);
        let prescribed = network.mechanism.prescribed.iter().map(|prescribed| &prescribed.element);
        let elements = frictions.chain(gears).chain(prescribed).map(Name::to_string).collect();
        let (time, (columns, derivatives)) = (self.grid.clone(), recorder.finish());
        let audit = balance;
        Trajectory { time, columns, derivatives, elements, events, status, grazing, audit }
    }
}

/// Simulate once: [`Plan::new`] and [`Plan::run`].
pub fn run<T: Real>(
    network: &Network<T>,
    signals: &[(&str, Signal<'_, T>)],
    start: &Start<T>,
    grid: &[f64],
    outputs: &[Output],
    options: RunOptions,
) -> Result<Trajectory<T>, SimulateError> {
    let plan = Plan::new(network, signals, grid, outputs, options)?;
    let start = start.state(network)?;
    plan.check_locks(network, &start)?;
    Ok(plan.run(network, &start))
}

/// [`run`] over plain numbers, compiled once for all callers.
pub fn run_network(
    network: &Network<f64>,
    signals: &[(&str, Signal<'_, f64>)],
    start: &Start<f64>,
    grid: &[f64],
    outputs: &[Output],
    options: RunOptions,
) -> Result<Trajectory<f64>, SimulateError> {
    run(network, signals, start, grid, outputs, options)
}

/// `ρ(A) h` to which too long segments are divided: a cubic then leaves a few 1e-3 N·m.
const FINE: f64 = 0.4;
/// Most parts of a segment.
const MAX_PARTS: usize = 100;

/// The inputs with segments short enough for the exact operators. With nothing at rest the motion is the
/// fastest: every lock only lowers the highest frequency.
fn divided<T: Real>(network: &Network<T>, inputs: Inputs<T>) -> Inputs<T> {
    let capacity = vec![T::zero_(); network.frictions.len()];
    let Some(Mode { spectral_radius: radius, .. }) = network.mode(ModeKey::default(), &capacity)
    else {
        return inputs;
    };
    let radius = radius.re();
    inputs.divided(|length| match (radius * length, (radius * length / FINE).ceil()) {
        (reach, _) if reach <= MAX_SPECTRAL_STEP_SLIPPING => 1,
        (_, parts) if parts <= MAX_PARTS as f64 => parts as usize,
        _ => 1,
    })
}

/// The signals in the order in which the network numbers its inputs.
pub(super) fn join<T: Real>(
    network: &Network<T>,
    signals: &[(&str, Signal<'_, T>)],
    span: (f64, f64),
    grid: &[f64],
) -> Result<Inputs<T>, InputError> {
    let ordered = network
        .mechanism
        .inputs
        .iter()
        .map(|name| {
            let found = signals.iter().find(|signal| signal.0 == name);
            found.copied().ok_or_else(|| InputError::Missing { name: name.to_string() })
        })
        .collect::<Result<Vec<_>, _>>()?;
    for prescribed in &network.mechanism.prescribed {
        let (name, signal) = ordered[prescribed.input];
        refuse_jump(name, signal)?;
    }
    Inputs::join(&ordered, span, grid)
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
fn refuse_jump<T: Real>(name: &str, signal: Signal<'_, T>) -> Result<(), InputError> {
    let Signal::Samples { times, .. } = signal else { return Ok(()) };
    match times.windows(2).position(|w| w[0] == w[1]) {
        Some(i) => Err(InputError::Jump { name: name.to_owned(), time: times[i] }),
        None => Ok(()),
    }
}
