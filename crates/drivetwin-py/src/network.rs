// SPDX-License-Identifier: MIT
//! Simulation of any network of elements; see `drivetwin.simulation.network`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::plain::{Audit, Event, as_array, events_of};
use crate::scenario::{NamedScenario, parse, scenario_of};
use drivetwin_core::network::Network;
use drivetwin_core::simulate::{RunOptions, Scenario, SimulateError, run_network};
use drivetwin_core::solver::Settings;
use numpy::{PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;

/// Tolerance, longest step [s], fixed order, whether samples without events may be passed at once,
/// whether to audit the energy.
type Options = (f64, f64, Option<usize>, bool, bool);
/// Columns (n_outputs, n_time), events, status, audit.
type Run<'py> = (Bound<'py, PyArray2<f64>>, Vec<Event>, String, Option<Audit>);

/// Simulate a driveline given as JSON; outputs are such as `("speed", ["engine"])`.
#[pyfunction]
pub fn simulate_network<'py>(
    py: Python<'py>,
    driveline: &str,
    outputs: Vec<NamedOutput>,
    scenario: NamedScenario<'py>,
    grid: PyReadonlyArray1<'py, f64>,
    options: Options,
) -> PyResult<Run<'py>> {
    let (driveline, outputs) = (parse(driveline)?, outputs_of(&outputs)?);
    let grid = grid.as_slice()?;
    let Scenario { signals, start } = scenario_of(&scenario)?;
    let (tolerance, max_step, order, sprint, audit) = options;
    let settings = Settings { tolerance, max_step, order, exponential_steps: sprint };
    let options = RunOptions { settings, audit };
    let trajectory = call(py, || -> Result<_, SimulateError> {
        let network = Network::compile(&driveline)?;
        run_network(&network, &signals, &start, grid, &outputs, options)
    })?
    .map_err(|e| refused(&e))?;
    let columns = PyArray2::from_vec2(py, &trajectory.columns)?;
    let events = events_of(&trajectory);
    Ok((columns, events, trajectory.status.to_string(), trajectory.audit.map(as_array)))
}

/// Schema of the elements as JSON: a list of types, each with its fields.
#[pyfunction]
pub fn element_schema() -> PyResult<String> {
    let schema = drivetwin_core::model::element_schema();
    serde_json::to_string(&schema).map_err(|e| refused(&e))
}
