// SPDX-License-Identifier: MIT
//! Pressure of an actuator by its command; see `drivetwin.actuator.model`.

use crate::border::call;
use crate::border::refused;
use drivetwin_core::control::ActuatorModel;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

/// Pressure [Pa] at increasing times `at` [s] of an actuator given as JSON. `command` is held between its times [s]
/// and values [Pa]; `initial` [Pa] is the pressure before it.
#[pyfunction]
pub fn actuator_pressure<'py>(
    py: Python<'py>,
    model: &str,
    command: (PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>),
    initial: Option<f64>,
    at: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let model: ActuatorModel = serde_json::from_str(model).map_err(|e| refused(&e))?;
    let (times, values) = (command.0.as_slice()?, command.1.as_slice()?);
    let commands: Vec<(f64, f64)> = times.iter().copied().zip(values.iter().copied()).collect();
    let at = at.as_slice()?;
    let pressure = call(py, || model.respond(&commands, initial, at))?;
    Ok(PyArray1::from_vec(py, pressure))
}
