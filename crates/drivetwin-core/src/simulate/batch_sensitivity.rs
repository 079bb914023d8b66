// SPDX-License-Identifier: MIT
//! Exact derivatives of what a batch keeps, run by run over all cores.

use super::batch::{Batch, Keep, Outcome, last_lock};
use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError};
use super::sensitivity::{LANES, Scenario, Seeded, SensitivityError, Unknowns};
use super::sets::{Case, ParameterSets, Sets};
use super::threads::share_out;
use super::trajectory::Trajectory;
use crate::model::Driveline;
use crate::network::Network;
use crate::number::Dual;
use crate::solver::{Settings, Status};

/// A number with its derivatives by the unknowns of one pass.
type Derived = Dual<LANES>;

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
    /// Derivatives of the kept numbers, runs × unknowns × kept.
    pub kept: Vec<f64>,
    /// Derivatives of the time of the last lock, runs × unknowns.
    pub last_lock: Vec<f64>,
    /// Runs of which an event only grazed its guard, its time [s] and element: no derivatives there.
    pub grazing: Vec<(usize, f64, String)>,
}

/// Simulate as [`super::batch`], and differentiate by the unknowns.
pub fn batch_sensitivities(
    driveline: &Driveline<f64>,
    scenarios: &[Scenario<'_>],
    parameters: ParameterSets<'_>,
    recording: Recording<'_>,
    unknowns: Unknowns<'_>,
    threads: usize,
) -> Result<(Batch, BatchDerivatives), SensitivityError> {
    let Recording { grid, outputs, keep } = recording;
    let starts = scenarios.iter().map(|scenario| &scenario.start).collect();
    let sets = Sets::new(driveline, starts, parameters)?;
    let mut plans = Vec::with_capacity(scenarios.len());
    for Scenario { signals, start } in scenarios {
        let case = Case { driveline: driveline.clone(), start: start.clone() };
        let plan = |pass| recording.plan(unknowns.seed(pass, 0, &case, signals)?);
        plans.push((0..unknowns.passes()).map(plan).collect::<Result<Vec<_>, _>>()?);
    }
    (0..sets.count()).try_for_each(|i| unknowns.check_corners(&mut sets.place_runs(&[i])))?;
    let run = |i: usize| -> Result<Vec<Kept>, SimulateError> {
        let Scenario { signals, .. } = &scenarios[i % scenarios.len()];
        let case = sets.place_runs(&[i]);
        let passes = plans[i % plans.len()].iter().enumerate().map(|(pass, plan)| {
            let seeded = unknowns.seed(pass, i, &case, signals).expect("paths that were checked");
            let (network, state) = seeded.case.compile()?;
            Ok(Kept::of(plan.adapt(&network, &state)?.run(&network, &state), keep))
        });
        passes.collect()
    };
    let mut passes = Vec::new();
    passes.resize_with(sets.count(), || None);
    share_out(threads, passes.iter_mut().enumerate(), |(i, pass)| *pass = Some(run(i)));
    let interrupted = || Err(SimulateError::Interrupted);
    let passes = passes.into_iter().map(|pass| pass.unwrap_or_else(interrupted)).collect();
    Ok(collect_runs(passes, keep.size(outputs.len(), grid.len()), unknowns.count))
}

impl Recording<'_> {
    /// The scenario made ready for the unknowns of one pass.
    fn plan(&self, seeded: Seeded<'_, LANES>) -> Result<Plan<Derived>, SensitivityError> {
        let Seeded { case, signals } = seeded;
        let network = Network::compile(&case.driveline).map_err(SimulateError::from)?;
        let options = RunOptions { settings: Settings::default(), audit: false };
        Ok(Plan::new(&network, &signals, self.grid, self.outputs, options)?)
    }
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

/// All runs in their order; `size` numbers are kept of each, derived by so many unknowns.
fn collect_runs(
    runs: Vec<Result<Vec<Kept>, SimulateError>>,
    size: usize,
    unknowns: usize,
) -> (Batch, BatchDerivatives) {
    let mut batch = Batch::default();
    let mut derivatives = BatchDerivatives {
        values: vec![],
        kept: vec![f64::NAN; runs.len() * unknowns * size],
        last_lock: vec![f64::NAN; runs.len() * unknowns],
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
        for k in 0..unknowns {
            let (pass, lane) = (&passes[k / LANES], k % LANES);
            let row = i * unknowns + k;
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
