// SPDX-License-Identifier: MIT
//! Driveline runs; see `drivetwin.simulation.network_response`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::scenario::{NamedScenario, NamedSeed, names_of, parse, scenario_of, seeds_of};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{
    Batch, Keep, Outcome, ParameterSets, Plan, Recording, RunOptions, Scenario, Unknowns, batch,
    batch_sensitivities as differentiate_batch,
};
use drivetwin_core::solver::{Settings, Status};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::prelude::*;

/// Measured columns (outputs, time) for a misfit, what to keep (`columns`, `last` or `misfit`).
type Wanted<'py> = (PyReadonlyArray2<'py, f64>, String);
/// Outputs, threads (0: all).
type Options = (Vec<NamedOutput>, usize);
/// Numbers of events, times of the last lock [s], failed runs and why.
pub type Ends<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<f64>>, Vec<(usize, String)>);
/// Flat values, flat derivatives, derivatives of the last locks, runs with a grazing event and why.
type Derived<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Vec<(usize, String)>,
);

/// Simulate a driveline given as JSON under many parameter sets or in many scenarios, into flat `values`.
#[pyfunction]
pub fn simulate_batch<'py>(
    py: Python<'py>,
    driveline: &str,
    scenarios: Vec<NamedScenario<'py>>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    wanted: Wanted<'py>,
    into: (Options, PyReadwriteArray1<'py, f64>),
) -> PyResult<Ends<'py>> {
    let driveline = parse(driveline)?;
    let ((outputs, threads), mut values) = into;
    let outputs = outputs_of(&outputs)?;
    let network = Network::compile(&driveline).map_err(|e| refused(&e))?;
    let grid = grid.as_slice()?;
    let plan = |named: &NamedScenario<'_>| {
        let Scenario { signals, start } = scenario_of(named)?;
        let options = RunOptions { settings: Settings::default(), audit: false };
        let plan = Plan::new(&network, &signals, grid, &outputs, options);
        Ok((plan.map_err(|e| refused(&e))?, start))
    };
    let plans = scenarios.iter().map(plan).collect::<PyResult<Vec<_>>>()?;
    let paths = names_of(&sets.0);
    let sets = ParameterSets { paths: &paths, values: sets.1.as_slice()? };
    let measured = rows_of(&wanted.0);
    let keep = keep_of(&wanted.1, &measured)?;
    let values = values.as_slice_mut()?;
    let found = call(py, || batch(&driveline, &plans, sets, keep, threads, values))?;
    Ok(ends(py, found.map_err(|e| refused(&e))?))
}

/// Simulate as `simulate_batch`, with derivatives by so many unknowns, at least one.
#[pyfunction]
pub fn batch_sensitivities<'py>(
    py: Python<'py>,
    driveline: &str,
    scenarios: Vec<NamedScenario<'py>>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    wanted: Wanted<'py>,
    by: (Options, (usize, Vec<NamedSeed<'py>>)),
) -> PyResult<(Ends<'py>, Derived<'py>)> {
    let driveline = parse(driveline)?;
    let ((outputs, threads), (count, seeds)) = by;
    let (outputs, seeds) = (outputs_of(&outputs)?, seeds_of(&seeds)?);
    let scenarios = scenarios.iter().map(scenario_of).collect::<PyResult<Vec<_>>>()?;
    let paths = names_of(&sets.0);
    let sets = ParameterSets { paths: &paths, values: sets.1.as_slice()? };
    let measured = rows_of(&wanted.0);
    let keep = keep_of(&wanted.1, &measured)?;
    let recording = Recording { grid: grid.as_slice()?, outputs: &outputs, keep };
    let unknowns = Unknowns { count, seeds: &seeds };
    let done = call(py, || {
        differentiate_batch(&driveline, &scenarios, sets, recording, unknowns, threads)
    })?;
    let (batch, derivatives) = done.map_err(|e| refused(&e))?;
    let grazing = derivatives.grazing.iter();
    let grazing = grazing
        .map(|(i, time, element)| (*i, format!("{element} grazes its event at {time:.9} s")));
    let grazing = grazing.collect();
    let [values, kept, last_lock] = [derivatives.values, derivatives.kept, derivatives.last_lock]
        .map(|numbers| PyArray1::from_vec(py, numbers));
    Ok((ends(py, batch), (values, kept, last_lock, grazing)))
}

fn rows_of(array: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}

fn keep_of<'m>(name: &str, measured: &'m [Vec<f64>]) -> PyResult<Keep<'m>> {
    match name {
        "columns" => Ok(Keep::Columns),
        "last" => Ok(Keep::Last),
        "misfit" => Ok(Keep::Misfit(measured)),
        other => Err(refused(&format!("{other:?} cannot be kept"))),
    }
}

/// Convert the outcomes of a batch.
pub fn ends(py: Python<'_>, batch: Batch) -> Ends<'_> {
    let failed = batch.outcomes.iter().enumerate().filter_map(|(i, outcome)| match outcome {
        Outcome::Ran(Status::Completed) => None,
        Outcome::Ran(status) => Some((i, status.to_string())),
        Outcome::Refused(error) => Some((i, error.to_string())),
    });
    let failed = failed.collect();
    (PyArray1::from_vec(py, batch.events), PyArray1::from_vec(py, batch.last_lock), failed)
}
