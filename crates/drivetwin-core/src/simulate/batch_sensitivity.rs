// SPDX-License-Identifier: MIT
//! Exact derivatives of what a batch keeps, run by run over all cores.

use super::batch::{Batch, Keep, Outcome, Sets, check_names, last_lock};
use super::dual_clutch::DualClutchStart;
use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError};
use super::sensitivity::{
    LANES, Sampled, SensitivityError, apply_delays, check_corners, seed_variables,
};
use super::threads::share_out;
use super::trajectory::Trajectory;
use crate::model::dual_clutch::DualClutch;
use crate::network::Network;
use crate::number::Dual;
use crate::solver::{Settings, Status};

/// A number with its derivatives by the parameters of one pass.
type Derived = Dual<LANES>;

/// Inputs and start of a run.
pub type Stated<'a> = (Vec<Sampled<'a>>, DualClutchStart<f64>);

/// Parameter sets of a batch.
#[derive(Clone, Copy, Debug)]
pub struct ParameterSets<'a> {
    /// Names of the parameters.
    pub names: &'a [&'a str],
    /// Values, sets × parameters.
    pub values: &'a [f64],
}

/// Outputs that are recorded of every run, and the numbers that are kept of them.
#[derive(Clone, Copy, Debug)]
pub struct Recording<'a> {
    /// Grid, s.
    pub grid: &'a [f64],
    /// Outputs.
    pub outputs: &'a [Output],
    /// Numbers that are kept.
    pub keep: Keep<'a>,
}

/// Output of a batch with its derivatives; NaN for failed runs.
#[derive(Clone, Debug)]
pub struct BatchDerivatives {
    /// Kept numbers, runs × kept.
    pub values: Vec<f64>,
    /// Derivatives of the kept numbers, runs × parameters × kept.
    pub kept: Vec<f64>,
    /// Derivatives of the time of the last lock, runs × parameters.
    pub last_lock: Vec<f64>,
    /// Runs of which an event only grazed its guard, its time [s] and element: no derivatives there.
    pub grazing: Vec<(usize, f64, String)>,
}

/// As [`super::dual_clutch_batch`], with the derivatives `by` the named parameters, which may also be
/// delays; see [`super::dual_clutch_sensitivities`].
pub fn dual_clutch_batch_sensitivities(
    model: &DualClutch<f64>,
    scenarios: &[Stated<'_>],
    parameters: ParameterSets<'_>,
    recording: Recording<'_>,
    by: &[&str],
    threads: usize,
) -> Result<(Batch, BatchDerivatives), SensitivityError> {
    let ParameterSets { names: parameters, values: sets } = parameters;
    let Recording { grid, outputs, keep } = recording;
    if let Some((_, start)) = scenarios.first() {
        check_names(model, start, parameters, sets)?;
    }
    let groups: Vec<&[&str]> = by.chunks(LANES).collect();
    let mut plans = Vec::with_capacity(scenarios.len());
    for (signals, start) in scenarios {
        let plan = |names: &&[&str]| plan(model, signals, start, grid, outputs, names);
        plans.push(groups.iter().map(plan).collect::<Result<Vec<_>, _>>()?);
    }
    let starts = scenarios.iter().map(|(_, start)| start).collect();
    let sets = Sets { model, starts, parameters, sets };
    (0..sets.count()).try_for_each(|i| check_corners(by, &sets.place_runs(&[i]).0))?;
    let run = |i: usize| -> Result<Vec<Kept>, SimulateError> {
        let (signals, _) = &scenarios[i % scenarios.len()];
        let (model, start) = sets.place_runs(&[i]);
        let passes = groups.iter().zip(&plans[i % plans.len()]).map(|(names, plan)| {
            let (model, start, _) =
                seed_variables(&model, signals, &start, names).expect("names that were checked");
            let network = Network::compile(&model.driveline())?;
            plan.check(&network)?;
            let state = start.state(&network)?;
            Ok(Kept::of(plan.run(&network, &state), keep))
        });
        passes.collect()
    };
    let mut passes = Vec::new();
    passes.resize_with(sets.count(), || None);
    share_out(threads, passes.iter_mut().enumerate(), |(i, pass)| *pass = Some(run(i)));
    let interrupted = || Err(SimulateError::Interrupted);
    let passes = passes.into_iter().map(|pass| pass.unwrap_or_else(interrupted)).collect();
    Ok(collect_runs(passes, keep.size(outputs.len(), grid.len()), by.len()))
}

/// The scenario made ready for one group of variables.
fn plan(
    model: &DualClutch<f64>,
    signals: &[Sampled<'_>],
    start: &DualClutchStart<f64>,
    grid: &[f64],
    outputs: &[Output],
    names: &[&str],
) -> Result<Plan<Derived>, SensitivityError> {
    let (model, _, delays) = seed_variables(model, signals, start, names)?;
    let network = Network::compile(&model.driveline()).map_err(SimulateError::from)?;
    let inputs = apply_delays(signals, &delays);
    Ok(Plan::new(
        &network,
        &inputs,
        grid,
        outputs,
        RunOptions { settings: Settings::default(), audit: false },
    )?)
}

/// Result of one pass of a run.
struct Kept {
    values: Vec<f64>,
    /// Parameters of the pass × kept.
    derivatives: Vec<f64>,
    last_lock: Derived,
    events: u32,
    status: Status,
    grazing: Option<(f64, String)>,
}

impl Kept {
    fn of(run: Trajectory<Derived>, keep: Keep<'_>) -> Self {
        let failed = run.status != Status::Completed;
        let size = keep.size(run.columns.len(), run.time.len());
        let mut values = vec![f64::NAN; size];
        let mut derivatives = vec![f64::NAN; LANES * size];
        if !failed && size > 0 {
            keep.reduce(&run.columns.concat(), run.time.len(), &mut values);
            keep.reduce_slopes(&run.columns, &run.derivatives, &mut derivatives);
        }
        let nothing = Derived::new(f64::NAN, [f64::NAN; LANES]);
        Self {
            values,
            derivatives,
            last_lock: last_lock(&run.events).unwrap_or(nothing),
            events: run.events.len() as u32,
            status: run.status,
            grazing: run.grazing,
        }
    }
}

/// All runs in their order; `size` numbers are kept of each, derived by so many parameters.
fn collect_runs(
    runs: Vec<Result<Vec<Kept>, SimulateError>>,
    size: usize,
    parameters: usize,
) -> (Batch, BatchDerivatives) {
    let mut batch = Batch::default();
    let mut derivatives = BatchDerivatives {
        values: vec![],
        kept: vec![f64::NAN; runs.len() * parameters * size],
        last_lock: vec![f64::NAN; runs.len() * parameters],
        grazing: vec![],
    };
    for (i, passes) in runs.into_iter().enumerate() {
        let passes = match passes {
            Ok(passes) => passes,
            Err(error) => {
                derivatives.values.resize((i + 1) * size, f64::NAN);
                batch.outcomes.push(Outcome::Refused(error));
                batch.events.push(0);
                batch.last_lock.push(f64::NAN);
                continue;
            }
        };
        for k in 0..parameters {
            let (pass, lane) = (&passes[k / LANES], k % LANES);
            let row = i * parameters + k;
            let found = &pass.derivatives[lane * size..][..size];
            derivatives.kept[row * size..][..size].copy_from_slice(found);
            derivatives.last_lock[row] = pass.last_lock.eps[lane];
        }
        let Some(first) = passes.into_iter().next() else { continue };
        derivatives.values.extend(first.values);
        batch.outcomes.push(Outcome::Ran(first.status));
        batch.events.push(first.events);
        batch.last_lock.push(first.last_lock.re);
        derivatives.grazing.extend(first.grazing.map(|(time, element)| (i, time, element)));
    }
    (batch, derivatives)
}
