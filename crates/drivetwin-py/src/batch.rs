// SPDX-License-Identifier: MIT
//! Many runs of the dual-clutch driveline; see `drivetwin.simulation.batch`.

use crate::border::call;
use crate::dual_clutch::{Delayed, Start, model_of, start_of};
use crate::output::{NamedOutput, outputs_of};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{
    Batch, Keep, Outcome, ParameterSets, Plan, Recording, RunOptions, Sampled, dual_clutch_batch,
    dual_clutch_batch_sensitivities,
};
use drivetwin_core::solver::{Settings, Signal, Status};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Inputs and start of one scenario.
type Scenario<'py> = (Vec<Delayed<'py>>, Start);
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
    model: &str,
    scenarios: Vec<Scenario<'py>>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    wanted: Wanted<'py>,
    into: (Options, PyReadwriteArray1<'py, f64>),
) -> PyResult<Ends<'py>> {
    let model = model_of(model)?;
    let (options, mut values) = into;
    let (outputs, threads) = (outputs_of(&options.0)?, options.1);
    let network = Network::compile(&model.driveline()).map_err(|e| refused(&e))?;
    let grid = grid.as_slice()?;
    let mut plans = Vec::with_capacity(scenarios.len());
    for (signals, start) in &scenarios {
        let signals: Vec<_> = sampled(signals)?
            .into_iter()
            .map(|Sampled { name, times, values, delay }| {
                (name, Signal::Samples { times, values, delay })
            })
            .collect();
        let plan = Plan::new(
            &network,
            &signals,
            grid,
            &outputs,
            RunOptions { settings: Settings::default(), audit: false },
        );
        plans.push((plan.map_err(|e| refused(&e))?, start_of(start.clone())));
    }
    let (names, sets) = (names_of(&sets.0), sets.1.as_slice()?);
    let measured = rows_of(&wanted.0);
    let keep = keep_of(&wanted.1, &measured)?;
    let values = values.as_slice_mut()?;
    let batch =
        call(py, || dual_clutch_batch(&model, &plans, &names, sets, keep, threads, values))?;
    let batch = batch.map_err(|e| refused(&e))?;
    Ok(ends(py, batch))
}

/// Simulate as `simulate_batch`, with derivatives by the named parameters, at least one.
#[pyfunction]
pub fn batch_sensitivities<'py>(
    py: Python<'py>,
    model: &str,
    scenarios: Vec<Scenario<'py>>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: (PyReadonlyArray1<'py, f64>, Vec<String>),
    wanted: Wanted<'py>,
    options: Options,
) -> PyResult<(Ends<'py>, Derived<'py>)> {
    let model = model_of(model)?;
    let (outputs, threads) = (outputs_of(&options.0)?, options.1);
    let (grid, by) = (grid.0.as_slice()?, names_of(&grid.1));
    let scenarios = scenarios
        .iter()
        .map(|(signals, start)| Ok((sampled(signals)?, start_of(start.clone()))))
        .collect::<PyResult<Vec<_>>>()?;
    let (names, sets) = (names_of(&sets.0), sets.1.as_slice()?);
    let measured = rows_of(&wanted.0);
    let keep = keep_of(&wanted.1, &measured)?;
    let sets = ParameterSets { names: &names, values: sets };
    let recording = Recording { grid, outputs: &outputs, keep };
    let done = call(py, || {
        dual_clutch_batch_sensitivities(&model, &scenarios, sets, recording, &by, threads)
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

pub fn refused(error: &dyn std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub fn names_of(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}

fn rows_of(array: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    array.as_array().rows().into_iter().map(|row| row.to_vec()).collect()
}

fn sampled<'a>(signals: &'a [Delayed<'_>]) -> PyResult<Vec<Sampled<'a>>> {
    signals
        .iter()
        .map(|(name, times, values, delay)| {
            let (times, values) = (times.as_slice()?, values.as_slice()?);
            Ok(Sampled { name, times, values, delay: *delay })
        })
        .collect()
}

fn keep_of<'m>(name: &str, measured: &'m [Vec<f64>]) -> PyResult<Keep<'m>> {
    match name {
        "columns" => Ok(Keep::Columns),
        "last" => Ok(Keep::Last),
        "misfit" => Ok(Keep::Misfit(measured)),
        other => Err(refused(&format!("{other:?} cannot be kept"))),
    }
}

pub fn ends(py: Python<'_>, batch: Batch) -> Ends<'_> {
    let failed = batch.outcomes.iter().enumerate().filter_map(|(i, outcome)| match outcome {
        Outcome::Ran(Status::Completed) => None,
        Outcome::Ran(status) => Some((i, status.to_string())),
        Outcome::Refused(error) => Some((i, error.to_string())),
    });
    let failed = failed.collect();
    (PyArray1::from_vec(py, batch.events), PyArray1::from_vec(py, batch.last_lock), failed)
}
