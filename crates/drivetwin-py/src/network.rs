// SPDX-License-Identifier: MIT
//! Simulation of any network of elements; see `drivetwin.simulation.network`.

use crate::border::call;
use crate::output::{NamedOutput, outputs_of};
use crate::plain::{Audit, Event, as_array, events_of};
use drivetwin_core::model::{Driveline, Element};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{RunOptions, Start, run_network};
use drivetwin_core::solver::{Settings, Signal};
use numpy::{PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// Input name, times [s] and values.
type Samples<'py> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);
/// Input name, offset, amplitude, frequency [Hz], phase [rad].
pub type Sine = (String, f64, f64, f64, f64);
/// Speeds [rad/s] by node, twists [rad] by shaft, names of elements at rest.
type StartState = (Vec<(String, f64)>, Vec<(String, f64)>, Vec<String>);
/// Tolerance, longest step [s], fixed order, whether samples without events may be passed at once,
/// whether to audit the energy.
type Options = (f64, f64, Option<usize>, bool, bool);
/// Columns (n_outputs, n_time), events, status, audit.
type Run<'py> = (Bound<'py, PyArray2<f64>>, Vec<Event>, String, Option<Audit>);

/// Simulate a driveline given as JSON; outputs are such as `("speed", ["engine"])`.
#[pyfunction]
#[pyo3(signature = (driveline, outputs, signals, start, grid, options))]
pub fn simulate_network<'py>(
    py: Python<'py>,
    driveline: &str,
    outputs: Vec<NamedOutput>,
    signals: (Vec<Samples<'py>>, Vec<Sine>),
    start: StartState,
    grid: PyReadonlyArray1<'py, f64>,
    options: Options,
) -> PyResult<Run<'py>> {
    let (driveline, outputs) = (parse(driveline)?, outputs_of(&outputs)?);
    let grid = grid.as_slice()?;
    let (samples, sines) = signals;
    let mut inputs = samples
        .iter()
        .map(|(name, times, values)| {
            Ok((name.as_str(), Signal::samples(times.as_slice()?, values.as_slice()?)))
        })
        .collect::<PyResult<Vec<_>>>()?;
    inputs.extend(sines.iter().map(|&(ref name, offset, amplitude, frequency, phase)| {
        (name.as_str(), Signal::Sine { offset, amplitude, frequency, phase })
    }));
    let (speeds, twists, locked) = start;
    let start = Start { speeds, twists, locked };
    let (tolerance, max_step, order, sprint, audit) = options;
    let settings = Settings { tolerance, max_step, order, exponential_steps: sprint };
    let trajectory = call(py, || {
        let network = Network::compile(&driveline)?;
        run_network(&network, &inputs, &start, grid, &outputs, RunOptions { settings, audit })
    })?
    .map_err(|e| PyValueError::new_err(e.to_string()))?;
    let columns = PyArray2::from_vec2(py, &trajectory.columns)?;
    let events = events_of(&trajectory);
    Ok((columns, events, trajectory.status.to_string(), trajectory.audit.map(as_array)))
}

/// Schema of the elements as JSON: a list of types, each with its fields.
#[pyfunction]
pub fn element_schema() -> PyResult<String> {
    let schema = drivetwin_core::model::element_schema();
    serde_json::to_string(&schema).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Read the elements; where that fails one by one, so that a fault names its element.
pub fn parse<T: DeserializeOwned>(elements: &str) -> PyResult<Driveline<T>> {
    if let Ok(elements) = serde_json::from_str(elements) {
        return Ok(Driveline { elements });
    }
    let refuse = |name: &str, e: serde_json::Error| PyValueError::new_err(format!("{name}: {e}"));
    let all: Vec<serde_json::Value> =
        serde_json::from_str(elements).map_err(|e| refuse("elements", e))?;
    let element = |(i, value): (usize, serde_json::Value)| -> PyResult<Element<T>> {
        let name = value.get("name").and_then(|name| name.as_str());
        let name = name.map_or_else(|| format!("element {i}"), ToOwned::to_owned);
        serde_json::from_value(value).map_err(|e| refuse(&name, e))
    };
    let elements = all.into_iter().enumerate().map(element).collect::<PyResult<_>>()?;
    Ok(Driveline { elements })
}
