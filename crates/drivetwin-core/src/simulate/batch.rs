// SPDX-License-Identifier: MIT
//! Many runs over the same samples: parameter sets on one scenario, or scenarios on one driveline.

use super::lockstep_recorder::{GridPoints, Recorder};
use super::run::{Plan, SimulateError};
use super::sensitivity::SensitivityError;
use super::sets::{ParameterSets, Sets};
use super::start::{Start, State};
use super::threads::share_out;
use crate::model::Driveline;
use crate::number::{Real, with_consensus};
use crate::solver::{
    Event, EventKind, Inputs, LANES, Lanes, NO_POINT, SolverCache, Status, lane_mask, run_lockstep,
};
use std::borrow::Cow;

/// Output kept of every run.
#[derive(Clone, Copy, Debug)]
pub enum Keep<'m> {
    /// Every output on the grid: runs × outputs × grid.
    Columns,
    /// Every output at the end: runs × outputs.
    Last,
    /// Sum over the grid of the squared distances to measured columns (outputs × grid), of which NaN are
    /// left out: runs × outputs.
    Misfit(&'m [Vec<f64>]),
}

/// Outcome of one run of a batch.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// Finished; holds the run status.
    Ran(Status),
    /// It could not be started.
    Refused(SimulateError),
}

/// Outcomes of the runs of a batch, in their order.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Outcome of each run.
    pub outcomes: Vec<Outcome>,
    /// Number of events of each run.
    pub events: Vec<u32>,
    /// Time of the last lock of each run, s; NaN without one.
    pub last_lock: Vec<f64>,
}

/// Simulate a driveline under parameter sets, in one scenario or in one for every run: `scenarios` are plans
/// and starts, run i takes that of its number or the only one.
///
/// The kept numbers of each run ([`Keep::size`]) overwrite `values`, which the caller allocates. Failed
/// runs give NaN.
///
/// # Panics
///
/// If `values` is not as long as what is kept of all runs.
pub fn batch(
    driveline: &Driveline<f64>,
    scenarios: &[(Plan<f64>, Start<f64>)],
    parameters: ParameterSets<'_>,
    keep: Keep<'_>,
    threads: usize,
    values: &mut [f64],
) -> Result<Batch, SensitivityError> {
    let starts = scenarios.iter().map(|(_, start)| start).collect();
    let plans: Vec<&Plan<f64>> = scenarios.iter().map(|(plan, _)| plan).collect();
    let sets = Sets::new(driveline, starts, parameters)?;
    let count = if scenarios.is_empty() { 0 } else { sets.count() };
    let size = plans.first().map_or(0, |plan| keep.size(plan.targets.len(), plan.grid.len()));
    let work = Work { sets, plans, keep, threads };
    assert_eq!(values.len(), count * size, "places for what is kept");
    Ok(work.result(count, size, values))
}

/// Time of the last lock [s].
pub(super) fn last_lock<T: Real>(events: &[Event<T>]) -> Option<T> {
    events.iter().rfind(|event| event.kind == EventKind::Lock).map(|event| event.time)
}

/// A run of a batch.
struct Job<'v> {
    run: usize,
    /// Output kept of the run.
    values: &'v mut [f64],
    outcome: Option<Outcome>,
    events: Vec<Event<f64>>,
}

/// How often runs are tried side by side, those that have parted with new neighbours, before they are done
/// alone.
const ATTEMPTS: usize = 2;

/// Runs to be done and what is kept of them.
struct Work<'w> {
    sets: Sets<'w>,
    plans: Vec<&'w Plan<f64>>,
    keep: Keep<'w>,
    threads: usize,
}

impl Work<'_> {
    fn plan(&self, run: usize) -> &Plan<f64> {
        self.plans[run % self.plans.len()]
    }

    /// Do so many runs, of each of which `size` numbers are kept.
    fn result(&self, count: usize, size: usize, values: &mut [f64]) -> Batch {
        let mut rest = values;
        let job = |run| {
            let (values, others) = std::mem::take(&mut rest).split_at_mut(size);
            rest = others;
            Job { run, values, outcome: None, events: Vec::new() }
        };
        let mut jobs: Vec<Job<'_>> = (0..count).map(job).collect();
        self.run_all(&mut jobs);
        let mut result = Batch::default();
        for job in jobs {
            let interrupted = Outcome::Refused(SimulateError::Interrupted);
            result.outcomes.push(job.outcome.unwrap_or(interrupted));
            result.events.push(job.events.len() as u32);
            result.last_lock.push(last_lock(&job.events).unwrap_or(f64::NAN));
        }
        result
    }

    /// Do all jobs: side by side as far as they go together. The results depend neither on that nor on the
    /// number of threads.
    fn run_all(&self, jobs: &mut [Job<'_>]) {
        let mut open: Vec<&mut Job<'_>> = jobs.iter_mut().collect();
        for _ in 0..ATTEMPTS {
            share_out(self.threads, open.chunks_mut(LANES), |group| self.run_group(group));
            open.retain(|job| job.outcome.is_none());
        }
        share_out(self.threads, open.iter_mut(), |job| self.run_single(job));
    }

    fn run_single(&self, job: &mut Job<'_>) {
        let prepared = self.sets.place_runs(&[job.run]).compile();
        let run = prepared.and_then(|(network, state)| {
            Ok(self.plan(job.run).adapt(&network, &state)?.run(&network, &state))
        });
        let run = match run {
            Ok(run) => run,
            Err(error) => {
                job.values.fill(f64::NAN);
                job.outcome = Some(Outcome::Refused(error));
                return;
            }
        };
        if run.status == Status::Completed {
            self.keep.reduce(&run.columns.concat(), run.time.len(), job.values);
        } else {
            job.values.fill(f64::NAN);
        }
        (job.outcome, job.events) = (Some(Outcome::Ran(run.status)), run.events);
    }

    /// Do those of a group that go together with its first.
    fn run_group(&self, group: &mut [&mut Job<'_>]) {
        let runs: Vec<usize> = group.iter().map(|job| job.run).collect();
        let (plan, start) = (self.plan(runs[0]), self.sets.start(runs[0]));
        // Fewer are done as fast alone.
        let enough = runs.len() > LANES / 2 && plan.lockstep;
        let Some(points) = plan.points.as_deref().filter(|_| enough) else { return };
        let alike = |&run: &usize| {
            let (knots, others) = (plan.inputs.knots(), self.plan(run).inputs.knots());
            (std::ptr::eq(knots, others) || knots == others)
                && self.plan(run).lockstep
                && self.sets.start(run).is_alike(start)
        };
        let alike = lane_mask(runs.iter().map(alike));
        let case = self.sets.place_runs::<Lanes>(&runs);
        let (prepared, parting) = with_consensus(alike, || case.compile());
        let Ok((network, State { x, locked, .. })) = prepared else { return };
        if plan.find_targets(&network).as_ref() != Ok(&plan.targets) {
            return;
        }
        let inputs: Vec<&Inputs<f64>> = runs.iter().map(|&run| &*self.plan(run).inputs).collect();
        let all = std::array::from_fn(|place| inputs[if place < runs.len() { place } else { 0 }]);
        let (cache, mask) = (SolverCache::new(&network), alike & !parting);
        let (points, count) = self.keep.recorded(points, plan.grid.len());
        let columns = plan.targets.len() * count;
        let mut spare = Vec::new();
        let values: Vec<&mut [f64]> = if let Keep::Misfit(_) = self.keep {
            spare.resize(runs.len() * columns, f64::NAN);
            spare.chunks_exact_mut(columns.max(1)).collect()
        } else {
            group.iter_mut().for_each(|job| job.values.fill(f64::NAN));
            group.iter_mut().map(|job| &mut *job.values).collect()
        };
        let points = GridPoints { at_knots: &points, count };
        let mut recorder = Recorder::new(&network, &plan.targets, all, points, values);
        let events = run_lockstep(cache, &inputs, plan.settings, mask, x, &locked, &mut recorder);
        for (place, (job, events)) in group.iter_mut().zip(events).enumerate() {
            let Some(events) = events else { continue };
            let own = if spare.is_empty() { &*job.values } else { &spare[place * columns..] };
            // Points without a value: the run is done again alone.
            if own.iter().take(count).any(|value| value.is_nan()) {
                continue;
            }
            if !spare.is_empty() {
                self.keep.reduce(&spare[place * columns..][..columns], plan.grid.len(), job.values);
            }
            (job.outcome, job.events) = (Some(Outcome::Ran(Status::Completed)), events);
        }
    }
}

impl Keep<'_> {
    /// Numbers kept of a run with so many outputs and points.
    pub fn size(self, outputs: usize, points: usize) -> usize {
        match self {
            Self::Columns => outputs * points,
            Self::Last | Self::Misfit(_) => outputs,
        }
    }

    /// The points of a grid that have to be recorded, as at every knot, and their number.
    fn recorded(self, points: &[usize], count: usize) -> (Cow<'_, [usize]>, usize) {
        match self {
            Self::Columns | Self::Misfit(_) => (Cow::Borrowed(points), count),
            Self::Last => {
                let only = |&point: &usize| if point == count - 1 { 0 } else { NO_POINT };
                (points.iter().map(only).collect(), 1)
            }
        }
    }

    /// Reduce the columns of a run, outputs × points, to the kept numbers.
    pub(super) fn reduce(self, columns: &[f64], points: usize, out: &mut [f64]) {
        for (output, column) in columns.chunks_exact(points).enumerate() {
            match self {
                Self::Columns => out[output * points..][..points].copy_from_slice(column),
                Self::Last => out[output] = column[points - 1],
                Self::Misfit(measured) => {
                    let known = column.iter().zip(&measured[output]).filter(|(_, m)| !m.is_nan());
                    out[output] = known.map(|(c, m)| (c - m) * (c - m)).sum();
                }
            }
        }
    }

    /// The derivatives of what is kept of the columns, parameters × kept, by those of the columns.
    pub(super) fn reduce_slopes<const P: usize>(
        self,
        columns: &[Vec<f64>],
        slopes: &[Vec<[f64; P]>],
        out: &mut [f64],
    ) {
        let points = columns[0].len();
        let size = self.size(columns.len(), points);
        for (parameter, out) in out.chunks_exact_mut(size).enumerate() {
            for (output, (column, slopes)) in columns.iter().zip(slopes).enumerate() {
                let slope = |point: usize| slopes[point][parameter];
                match self {
                    Self::Columns => {
                        for (point, out) in out[output * points..][..points].iter_mut().enumerate()
                        {
                            *out = slope(point);
                        }
                    }
                    Self::Last => out[output] = slope(points - 1),
                    Self::Misfit(measured) => {
                        let measured = &measured[output];
                        let known = (0..points).filter(|&k| !measured[k].is_nan());
                        let terms = known.map(|k| 2.0 * (column[k] - measured[k]) * slope(k));
                        out[output] = terms.sum();
                    }
                }
            }
        }
    }
}
