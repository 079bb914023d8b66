// SPDX-License-Identifier: MIT
//! Simulation of the dual-clutch driveline; see `drivetwin.simulation.dual_clutch`.

use crate::border::call;
use crate::plain::{Audit, Event, as_array, events_of, status_of};
use drivetwin_core::model::DualClutch;
use drivetwin_core::simulate::{
    DualClutchStart, RunOptions, Sampled, dual_clutch_sensitivities, run_dual_clutch,
};
use drivetwin_core::solver::{Settings, Signal};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Name, times [s] and values of an input.
type Samples<'py> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);
/// Speeds of engine, output and wheel [rad/s], twist [rad], names of locked elements.
pub type Start = (f64, f64, f64, f64, Vec<String>);
/// Tolerance, longest step [s], fixed order, whether samples without events may be passed at once,
/// whether to audit the energy.
type Options = (f64, f64, Option<usize>, bool, bool);
/// Columns (n_columns, n_time), events, status, audit.
type Run<'py> = (Bound<'py, PyArray2<f64>>, Vec<Event>, String, Option<Audit>);

/// Simulate a dual-clutch driveline given as JSON.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    model: &str,
    signals: Vec<Samples<'py>>,
    start: Start,
    grid: PyReadonlyArray1<'py, f64>,
    options: Options,
) -> PyResult<Run<'py>> {
    let model = model_of(model)?;
    let grid = grid.as_slice()?;
    let signals = signals
        .iter()
        .map(|(name, times, values)| {
            Ok((name.as_str(), Signal::samples(times.as_slice()?, values.as_slice()?)))
        })
        .collect::<PyResult<Vec<_>>>()?;
    let start = start_of(start);
    let (tolerance, max_step, order, sprint, audit) = options;
    let settings = Settings { tolerance, max_step, order, exponential_steps: sprint };
    let options = RunOptions { settings, audit };
    let run = call(py, || run_dual_clutch(&model, &signals, &start, grid, options))?
        .map_err(|e| PyValueError::new_err(e.to_string()))?;
    let columns = PyArray2::from_vec2(py, &run.columns)?;
    let events = events_of(&run);
    Ok((columns, events, run.status.to_string(), run.audit.map(as_array)))
}

/// Columns (n_columns, n_time), events, status, derivatives of every column, pass by pass (n_time,
/// n_parameters of the pass), and of event times (n_parameters, n_events).
type Sensitive<'py> = (
    Bound<'py, PyArray2<f64>>,
    Vec<Event>,
    String,
    Vec<Vec<Bound<'py, PyArray2<f64>>>>,
    Bound<'py, PyArray2<f64>>,
);
/// Name, times [s], values and delay [s] of an input.
pub type Delayed<'py> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>, f64);

/// Simulate and differentiate by the named parameters.
#[pyfunction]
pub fn sensitivities<'py>(
    py: Python<'py>,
    model: &str,
    signals: Vec<Delayed<'py>>,
    start: Start,
    grid: PyReadonlyArray1<'py, f64>,
    options: (f64, Vec<String>),
) -> PyResult<Sensitive<'py>> {
    let model = model_of(model)?;
    let grid = grid.as_slice()?;
    let signals = signals
        .iter()
        .map(|(name, times, values, delay)| {
            let (times, values) = (times.as_slice()?, values.as_slice()?);
            Ok(Sampled { name, times, values, delay: *delay })
        })
        .collect::<PyResult<Vec<_>>>()?;
    let start = start_of(start);
    let (tolerance, parameters) = options;
    let names: Vec<&str> = parameters.iter().map(String::as_str).collect();
    let settings = Settings { tolerance, ..Settings::default() };
    let found =
        call(py, || dual_clutch_sensitivities(&model, &signals, &start, grid, settings, &names))?
            .map_err(|e| PyValueError::new_err(e.to_string()))?;
    // Handed over as they are, the memory of the core.
    let handed = |slopes: Vec<f64>| {
        let parameters = slopes.len() / grid.len();
        slopes.into_pyarray(py).reshape([grid.len(), parameters])
    };
    let passes = found.columns.into_iter();
    let derivatives = passes
        .map(|columns| columns.into_iter().map(handed).collect::<PyResult<_>>())
        .collect::<PyResult<_>>()?;
    Ok((
        PyArray2::from_vec2(py, &found.run.columns)?,
        events_of(&found.run),
        status_of(&found.run),
        derivatives,
        PyArray2::from_vec2(py, &found.events)?,
    ))
}

/// A driveline from its JSON.
pub fn model_of(json: &str) -> PyResult<DualClutch<f64>> {
    serde_json::from_str(json).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// The start as the core takes it.
pub fn start_of(start: Start) -> DualClutchStart<f64> {
    let (engine_speed, output_speed, wheel_speed, twist, locked) = start;
    DualClutchStart { engine_speed, output_speed, wheel_speed, twist, locked }
}
