// SPDX-License-Identifier: MIT
//! Many controlled runs; see `drivetwin.simulation.shift_control`.

use crate::batch::{Ends, ends};
use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::scenario::{NamedScenario, names_of, parse, scenario_of};
use drivetwin_core::control::{ControlledUnit, ShiftController};
use drivetwin_core::simulate::{ControlledRuns, ParameterSets, controlled_batch};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::prelude::*;

/// Outputs, whether inputs are recorded too, threads (0: all).
type Options = (Vec<NamedOutput>, bool, usize);

/// Simulate a driveline given as JSON under controllers, once per parameter set with its unit, into flat `values`:
/// sets × controllers × rows × grid. `controlled` are controllers and units, as JSON lists, and the input that is
/// the engine torque.
#[pyfunction]
pub fn simulate_controlled<'py>(
    py: Python<'py>,
    driveline: &str,
    scenario: NamedScenario<'py>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    controlled: (String, String, String),
    into: (Options, PyReadwriteArray1<'py, f64>),
) -> PyResult<Ends<'py>> {
    let (driveline, scenario) = (parse(driveline)?, scenario_of(&scenario)?);
    let ((outputs, with_inputs, threads), mut values) = into;
    let controllers: Vec<ShiftController> =
        serde_json::from_str(&controlled.0).map_err(|e| refused(&e))?;
    let units: Vec<ControlledUnit> =
        serde_json::from_str(&controlled.1).map_err(|e| refused(&e))?;
    let (outputs, paths) = (outputs_of(&outputs)?, names_of(&sets.0));
    let runs = ControlledRuns {
        controllers: &controllers,
        units: &units,
        engine_torque: &controlled.2,
        parameters: ParameterSets { paths: &paths, values: sets.1.as_slice()? },
        grid: grid.as_slice()?,
        outputs: &outputs,
        with_inputs,
    };
    let values = values.as_slice_mut()?;
    let batch = call(py, || controlled_batch(&driveline, &scenario, runs, threads, values))?;
    Ok(ends(py, batch.map_err(|e| refused(&e))?))
}
