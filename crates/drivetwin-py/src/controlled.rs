// SPDX-License-Identifier: MIT
//! Many controlled runs; see `drivetwin.simulation.shift_control`.

use crate::batch::{Ends, ends};
use crate::border::{call, refused};
use crate::external_controller::{ExternalController, Library};
use crate::output::{NamedOutput, outputs_of};
use crate::scenario::{NamedScenario, names_of, parse, scenario_of};
use drivetwin_core::control::{ControlledUnit, Controller, ShiftController};
use drivetwin_core::simulate::{ControlledRuns, ParameterSets, Wiring, controlled_batch};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1};
use pyo3::prelude::*;
use serde::Deserialize;

/// Outputs, whether inputs are recorded too, threads (0: all).
type Options = (Vec<NamedOutput>, bool, usize);

/// Controllers of a batch with the names and times that they share.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Controlled {
    controllers: Controllers,
    units: Vec<ControlledUnit>,
    task: f64,
    elements: [String; 2],
    engine_torque: String,
    speeds: Option<[String; 2]>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Controllers {
    BuiltIn(Vec<ShiftController>),
    External { library: Library, of: Vec<ExternalController> },
}

/// Simulate a driveline given as JSON under controllers, once per parameter set with its unit, into flat `values`:
/// sets × controllers × rows × grid. `controlled` is a JSON object, see [`Controlled`].
#[pyfunction]
pub fn simulate_controlled<'py>(
    py: Python<'py>,
    driveline: &str,
    scenario: NamedScenario<'py>,
    sets: (Vec<String>, PyReadonlyArray2<'py, f64>),
    grid: PyReadonlyArray1<'py, f64>,
    controlled: &str,
    into: (Options, PyReadwriteArray1<'py, f64>),
) -> PyResult<Ends<'py>> {
    let (driveline, scenario) = (parse(driveline)?, scenario_of(&scenario)?);
    let ((outputs, with_inputs, threads), mut values) = into;
    let given: Controlled = serde_json::from_str(controlled).map_err(|e| refused(&e))?;
    let external = match &given.controllers {
        Controllers::External { library, of } => of.iter().map(|one| one.bind(library)).collect(),
        Controllers::BuiltIn(_) => Vec::new(),
    };
    let controllers: Vec<&dyn Controller> = match &given.controllers {
        Controllers::BuiltIn(all) => all.iter().map(|one| one as &dyn Controller).collect(),
        Controllers::External { .. } => external.iter().map(|one| one as &dyn Controller).collect(),
    };
    let (outputs, paths) = (outputs_of(&outputs)?, names_of(&sets.0));
    let runs = ControlledRuns {
        controllers: &controllers,
        task: given.task,
        units: &given.units,
        wiring: Wiring {
            elements: [&given.elements[0], &given.elements[1]],
            engine_torque: &given.engine_torque,
            speeds: given.speeds.as_ref().map(|[engine, output]| [&engine[..], &output[..]]),
        },
        parameters: ParameterSets { paths: &paths, values: sets.1.as_slice()? },
        grid: grid.as_slice()?,
        outputs: &outputs,
        with_inputs,
    };
    let values = values.as_slice_mut()?;
    let batch = call(py, || controlled_batch(&driveline, &scenario, runs, threads, values))?;
    Ok(ends(py, batch.map_err(|e| refused(&e))?))
}
