// SPDX-License-Identifier: MIT
//! Many runs over the same samples: parameter sets on one scenario, or scenarios on one driveline.

use super::dual_clutch::DualClutchStart;
use super::run::{Plan, SimulateError};
use super::sensitivity::SensitivityError;
use super::start::State;
use super::trajectory::Recorder;
use crate::model::dual_clutch::DualClutch;
use crate::network::Network;
use crate::number::Real;
use crate::solve::{Event, EventKind, Integrator, Status, WIDTH, run_together};
use rayon::prelude::*;

/// What is kept of every run.
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

/// How one run of a batch ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It ran; its status.
    Ran(Status),
    /// It could not be started.
    Refused(SimulateError),
}

/// Result of a batch, in the order of the runs.
#[derive(Clone, Debug)]
pub struct Batch {
    /// What was kept; NaN for runs that failed.
    pub values: Vec<f64>,
    /// How each run ended.
    pub outcomes: Vec<Outcome>,
    /// Number of events of each run.
    pub events: Vec<u32>,
    /// Time of the last lock of each run, s; NaN without one.
    pub last_lock: Vec<f64>,
}

/// A network and its start.
pub type Prepared = (Network<f64>, State<f64>);

/// Run `count` scenarios; `make` gives network and start of a run, `plan_of` its plan. Runs over the same
/// knots go side by side; the result depends neither on that nor on the number of `threads`.
pub fn batch<'p>(
    count: usize,
    plan_of: impl Fn(usize) -> &'p Plan<f64> + Sync,
    make: impl Fn(usize) -> Result<Prepared, SimulateError> + Sync,
    (keep, threads): (Keep<'_>, usize),
) -> Batch {
    let per_run = if count == 0 { 0 } else { plan_of(0).kept(keep) };
    // Zeros: fresh from the system, memory is only touched when a group writes its results.
    let mut values = vec![0.0; count * per_run];
    let runs = count.div_ceil(WIDTH);
    let group = |(g, values): (usize, &mut [f64])| {
        let first = g * WIDTH;
        let members: Vec<usize> = (first..count.min(first + WIDTH)).collect();
        side_by_side(&members, (&plan_of, &make), keep, values)
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let mut all =
        || values.par_chunks_mut((WIDTH * per_run).max(1)).enumerate().map(group).collect();
    let ends: Vec<Vec<End>> = match (per_run, pool) {
        (0, _) => vec![Vec::new(); runs],
        (_, Ok(pool)) => pool.install(all),
        (_, Err(_)) => all(),
    };
    let mut result = Batch { values, outcomes: vec![], events: vec![], last_lock: vec![] };
    for End { outcome, events, last_lock } in ends.into_iter().flatten() {
        result.outcomes.push(outcome);
        result.events.push(events);
        result.last_lock.push(last_lock);
    }
    result
}

/// Simulate a dual-clutch driveline under `sets` of the named parameters (runs × parameters), in one
/// scenario or in one for every run: `scenarios` are plans and starts, run i takes that of its number or
/// the only one. Names are those of [`DualClutch::parameter_mut`] and, after `start.`, of the start.
pub fn dual_clutch_batch(
    model: &DualClutch<f64>,
    scenarios: &[(Plan<f64>, DualClutchStart<f64>)],
    (parameters, sets): (&[&str], &[f64]),
    options: (Keep<'_>, usize),
) -> Result<Batch, SensitivityError> {
    let width = parameters.len();
    let count = sets.len().checked_div(width).unwrap_or(scenarios.len());
    if let Some((_, start)) = scenarios.first() {
        check_names(model, start, (parameters, sets))?;
    }
    let scenario = |i: usize| &scenarios[i % scenarios.len()];
    let make = |i: usize| {
        let (model, start) = placed(model, &scenario(i).1, (parameters, sets), i);
        let network = Network::compile(&model.driveline())?;
        let state = start.state(&network)?;
        Ok((network, state))
    };
    Ok(batch(count, |i| &scenario(i).0, make, options))
}

/// Model and start of run `i` of a batch, whose names have been checked.
pub(super) fn placed(
    model: &DualClutch<f64>,
    start: &DualClutchStart<f64>,
    (parameters, sets): (&[&str], &[f64]),
    i: usize,
) -> (DualClutch<f64>, DualClutchStart<f64>) {
    let (mut model, mut start) = (model.clone(), start.clone());
    for (&name, &value) in parameters.iter().zip(&sets[i * parameters.len()..]) {
        *place(&mut model, &mut start, name).expect("names that were checked") = value;
    }
    (model, start)
}

/// Refuse names that are no parameters.
pub(super) fn check_names(
    model: &DualClutch<f64>,
    start: &DualClutchStart<f64>,
    (parameters, sets): (&[&str], &[f64]),
) -> Result<(), SensitivityError> {
    let (mut model, mut start) = (model.clone(), start.clone());
    let unknown = |name: &&&str| place(&mut model, &mut start, name).is_none();
    match parameters.iter().find(unknown) {
        Some(&name) if !sets.is_empty() => Err(SensitivityError::Unknown { name: name.to_owned() }),
        _ => Ok(()),
    }
}

fn place<'m>(
    model: &'m mut DualClutch<f64>,
    start: &'m mut DualClutchStart<f64>,
    name: &str,
) -> Option<&'m mut f64> {
    match name.split_once('.') {
        Some(("start", field)) => start.field_mut(field),
        _ => model.parameter_mut(name),
    }
}

/// How one run ended.
#[derive(Clone, Debug)]
struct End {
    outcome: Outcome,
    events: u32,
    last_lock: f64,
}

impl End {
    fn of(status: Status, events: &[Event<f64>]) -> Self {
        Self {
            outcome: Outcome::Ran(status),
            events: events.len() as u32,
            last_lock: last_lock(events).unwrap_or(f64::NAN),
        }
    }
}

/// Time of the last lock [s].
pub(super) fn last_lock<T: Real>(events: &[Event<T>]) -> Option<T> {
    events.iter().rfind(|event| event.kind == EventKind::Lock).map(|event| event.time)
}

/// A run of a batch that has been started.
struct Started<'p> {
    /// Its place among its neighbours.
    place: usize,
    run: Integrator<'p, f64>,
    recorder: Recorder<'p, f64>,
    outcome: Result<(), Status>,
}

/// Run up to [`WIDTH`] scenarios, those over the same knots together.
fn side_by_side<'p>(
    members: &[usize],
    (plan_of, make): (
        &(impl Fn(usize) -> &'p Plan<f64> + Sync),
        &(impl Fn(usize) -> Result<Prepared, SimulateError> + Sync),
    ),
    keep: Keep<'_>,
    values: &mut [f64],
) -> Vec<End> {
    let prepared: Vec<Result<Prepared, SimulateError>> = members.iter().map(|&i| make(i)).collect();
    let mut ends: Vec<End> = Vec::with_capacity(members.len());
    let mut started = Vec::with_capacity(members.len());
    for (place, (&i, prepared)) in members.iter().zip(&prepared).enumerate() {
        let nothing =
            End { outcome: Outcome::Ran(Status::Completed), events: 0, last_lock: f64::NAN };
        ends.push(match prepared {
            Err(error) => End { outcome: Outcome::Refused(error.clone()), ..nothing },
            Ok((network, state)) => match plan_of(i).start(network, state) {
                Err(status) => End { outcome: Outcome::Ran(status), ..nothing },
                Ok((run, recorder)) => {
                    started.push(Started { place, run, recorder, outcome: Ok(()) });
                    nothing
                }
            },
        });
    }
    run_all(&mut started);
    let per_run = values.len() / members.len();
    for Started { place, run, recorder, outcome } in started {
        let status = outcome.err().unwrap_or(Status::Completed);
        if status == Status::Completed {
            keep.reduce(&recorder.finish().0, &mut values[place * per_run..][..per_run]);
        }
        ends[place] = End::of(status, &run.events);
    }
    for (end, values) in ends.iter().zip(values.chunks_exact_mut(per_run)) {
        if end.outcome != Outcome::Ran(Status::Completed) {
            values.fill(f64::NAN);
        }
    }
    ends
}

/// Bring runs to their ends: those that pass samples over the same knots with as many states together.
fn run_all(started: &mut [Started<'_>]) {
    let (mut marching, alone): (Vec<_>, Vec<_>) =
        started.iter_mut().partition(|one| one.run.can_sprint());
    for one in alone {
        one.outcome = one.recorder.run_to_end(&mut one.run);
    }
    while let Some(first) = marching.first() {
        let (knots, states) = (first.run.knots(), first.run.x.len());
        let (mut group, rest): (Vec<_>, Vec<_>) = marching.into_iter().partition(|one| {
            let same = std::ptr::eq(one.run.knots(), knots) || one.run.knots() == knots;
            same && one.run.x.len() == states
        });
        let runs = group.iter_mut().map(|one| (&mut one.run, &mut one.recorder));
        let outcomes = run_together(runs);
        for (one, outcome) in group.into_iter().zip(outcomes) {
            one.outcome = outcome;
        }
        marching = rest;
    }
}

impl Keep<'_> {
    /// Numbers kept of a run with so many outputs and points.
    pub(super) fn size(self, outputs: usize, points: usize) -> usize {
        match self {
            Self::Columns => outputs * points,
            Self::Last | Self::Misfit(_) => outputs,
        }
    }

    /// What is kept of the columns of a run.
    pub(super) fn reduce(self, columns: &[Vec<f64>], out: &mut [f64]) {
        match self {
            Self::Columns => {
                for (column, out) in columns.iter().zip(out.chunks_exact_mut(columns[0].len())) {
                    out.copy_from_slice(column);
                }
            }
            Self::Last => {
                for (column, out) in columns.iter().zip(out) {
                    *out = column[column.len() - 1];
                }
            }
            Self::Misfit(measured) => {
                for ((column, measured), out) in columns.iter().zip(measured).zip(out) {
                    let known = column.iter().zip(measured).filter(|(_, m)| !m.is_nan());
                    *out = known.map(|(c, m)| (c - m) * (c - m)).sum();
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
