// SPDX-License-Identifier: MIT
//! Many controlled runs; see `drivetwin.simulation.controlled_batch`.

use crate::batch::{Ends, ends, names_of, refused};
use crate::border::call;
use crate::dual_clutch::{Start, model_of, start_of};
use crate::output::{NamedOutput, outputs_of};
use drivetwin_core::control::{ControlledUnit, ShiftController};
use drivetwin_core::simulate::{ControlledRuns, controlled_batch};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::prelude::*;

/// Outputs, whether inputs are recorded too, threads (0: all).
type Options = (Vec<NamedOutput>, bool, usize);

/// Simulate a driveline given as JSON under `controllers`, once per parameter set with its unit of `units` (JSON
/// lists), into flat `values`: sets × controllers × rows × grid.
#[pyfunction]
pub fn simulate_controlled<'py>(
    py: Python<'py>,
    model: &str,
    start: Start,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    controlled: (String, String),
    into: (Options, PyReadwriteArray1<'py, f64>),
) -> PyResult<Ends<'py>> {
    let (model, start) = (model_of(model)?, start_of(start));
    let ((outputs, with_inputs, threads), mut values) = into;
    let controllers: Vec<ShiftController> =
        serde_json::from_str(&controlled.0).map_err(|e| refused(&e))?;
    let units: Vec<ControlledUnit> =
        serde_json::from_str(&controlled.1).map_err(|e| refused(&e))?;
    let (outputs, names) = (outputs_of(&outputs)?, names_of(&sets.0));
    let runs = ControlledRuns {
        controllers: &controllers,
        units: &units,
        parameters: &names,
        sets: sets.1.as_slice()?,
        grid: grid.as_slice()?,
        outputs: &outputs,
        with_inputs,
    };
    let values = values.as_slice_mut()?;
    let batch = call(py, || controlled_batch(&model, &start, runs, threads, values))?;
    Ok(ends(py, batch.map_err(|e| refused(&e))?))
}
