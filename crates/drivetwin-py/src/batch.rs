// SPDX-License-Identifier: MIT
//! Many runs of the dual-clutch driveline; see `drivetwin.batch.simulate_batch`.

use crate::dual_clutch::{Start, model_of, start_of};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{Batch, Keep, Outcome, Output, Plan, dual_clutch_batch};
use drivetwin_core::solve::{Settings, Signal, Status};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Name, times [s] and values of every input, and the start, of one scenario.
type Scenario<'py> = (Vec<(String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>)>, Start);
/// What to keep (`columns`, `last` or `misfit`), outputs as a JSON list, threads (0: all).
type Options = (String, String, usize);
/// Flat values, numbers of events, times of the last lock [s], failed runs and why.
type Kept<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f64>>,
    Vec<(usize, String)>,
);

/// Simulate a driveline given as JSON under many parameter sets or in many scenarios.
#[pyfunction]
#[pyo3(signature = (model, scenarios, sets, grid, measured, options))]
pub fn simulate_batch<'py>(
    py: Python<'py>,
    model: &str,
    scenarios: Vec<Scenario<'py>>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    measured: PyReadonlyArray2<'py, f64>,
    options: Options,
) -> PyResult<Kept<'py>> {
    let refuse = |e: &dyn std::fmt::Display| PyValueError::new_err(e.to_string());
    let model = model_of(model)?;
    let (keep, outputs, threads) = options;
    let outputs: Vec<Output> = serde_json::from_str(&outputs).map_err(|e| refuse(&e))?;
    let network = Network::compile(&model.driveline()).map_err(|e| refuse(&e))?;
    let grid = grid.as_slice()?;
    let mut plans = Vec::with_capacity(scenarios.len());
    for (signals, start) in &scenarios {
        let signals = signals
            .iter()
            .map(|(name, times, values)| {
                Ok((name.as_str(), Signal::samples(times.as_slice()?, values.as_slice()?)))
            })
            .collect::<PyResult<Vec<_>>>()?;
        let plan = Plan::new(&network, &signals, grid, &outputs, (Settings::default(), false));
        plans.push((plan.map_err(|e| refuse(&e))?, start_of(start.clone())));
    }
    let (names, sets) = sets;
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let sets = sets.as_slice()?;
    let measured: Vec<Vec<f64>> =
        measured.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
    let keep = match keep.as_str() {
        "columns" => Keep::Columns,
        "last" => Keep::Last,
        "misfit" => Keep::Misfit(&measured),
        other => return Err(refuse(&format!("{other:?} cannot be kept"))),
    };
    let batch = py
        .detach(|| dual_clutch_batch(&model, &plans, (&names, sets), (keep, threads)))
        .map_err(|e| refuse(&e))?;
    Ok(kept(py, batch))
}

fn kept(py: Python<'_>, batch: Batch) -> Kept<'_> {
    let failed = batch.outcomes.iter().enumerate().filter_map(|(i, outcome)| match outcome {
        Outcome::Ran(Status::Completed) => None,
        Outcome::Ran(status) => Some((i, status.to_string())),
        Outcome::Refused(error) => Some((i, error.to_string())),
    });
    let failed = failed.collect();
    (
        PyArray1::from_vec(py, batch.values),
        PyArray1::from_vec(py, batch.events),
        PyArray1::from_vec(py, batch.last_lock),
        failed,
    )
}
