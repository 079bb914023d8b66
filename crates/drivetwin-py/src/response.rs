// SPDX-License-Identifier: MIT
//! Linear response of a run; see `drivetwin.simulation.network_response`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::scenario::{NamedScenario, parse, scenario_of};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{SimulateError, respond};
use drivetwin_core::solver::Settings;
use numpy::{IntoPyArray, PyArray3, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

/// Change of the state over each step (n - 1, S, S + m), outputs by the state (n - 1, outputs, S), names of
/// the inputs in their order, status.
type Found<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>, Vec<String>, String);

/// Compute the response of a driveline given as JSON to disturbances of its state and its inputs.
#[pyfunction]
pub fn network_response<'py>(
    py: Python<'py>,
    driveline: &str,
    outputs: Vec<NamedOutput>,
    scenario: NamedScenario<'py>,
    grid: PyReadonlyArray1<'py, f64>,
    options: (f64, f64),
) -> PyResult<Found<'py>> {
    let (driveline, outputs) = (parse(driveline)?, outputs_of(&outputs)?);
    let grid = grid.as_slice()?;
    let scenario = scenario_of(&scenario)?;
    let (tolerance, max_step) = options;
    let settings = Settings { tolerance, max_step, ..Settings::default() };
    let (found, names) = call(py, || -> Result<_, SimulateError> {
        let network = Network::compile(&driveline)?;
        let names = network.mechanism.inputs.iter().map(ToString::to_string).collect();
        Ok((respond(&driveline, &scenario, grid, &outputs, settings)?, names))
    })?
    .map_err(|e| refused(&e))?;
    let (count, states) = (grid.len() - 1, found.states);
    Ok((
        found.steps.into_pyarray(py).reshape([count, states, states + found.inputs])?,
        found.rows.into_pyarray(py).reshape([count, outputs.len(), states])?,
        names,
        found.status.to_string(),
    ))
}
