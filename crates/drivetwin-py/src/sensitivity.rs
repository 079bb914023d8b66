// SPDX-License-Identifier: MIT
//! Exact derivatives of a run by numbers at paths; see `drivetwin.simulation.dual_clutch`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::plain::{Event, events_of, status_of};
use crate::scenario::{NamedScenario, NamedSeed, parse, scenario_of, seeds_of};
use drivetwin_core::simulate::{Differentiation, Unknowns};
use drivetwin_core::solver::Settings;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

/// Columns (n_columns, n_time), events, status, derivatives of every column, pass by pass (n_time,
/// n_unknowns of the pass), and of event times (n_unknowns, n_events).
type Sensitive<'py> = (
    Bound<'py, PyArray2<f64>>,
    Vec<Event>,
    String,
    Vec<Vec<Bound<'py, PyArray2<f64>>>>,
    Bound<'py, PyArray2<f64>>,
);

/// Simulate a driveline given as JSON and differentiate by so many unknowns.
#[pyfunction]
pub fn sensitivities<'py>(
    py: Python<'py>,
    driveline: &str,
    outputs: Vec<NamedOutput>,
    scenario: NamedScenario<'py>,
    grid: PyReadonlyArray1<'py, f64>,
    unknowns: (usize, Vec<NamedSeed<'py>>),
) -> PyResult<Sensitive<'py>> {
    let (driveline, outputs) = (parse(driveline)?, outputs_of(&outputs)?);
    let (grid, seeds) = (grid.as_slice()?, seeds_of(&unknowns.1)?);
    let differentiation = Differentiation {
        driveline: &driveline,
        scenario: scenario_of(&scenario)?,
        grid,
        outputs: &outputs,
        settings: Settings::default(),
        unknowns: Unknowns { count: unknowns.0, seeds: &seeds },
    };
    let found = call(py, || differentiation.run())?.map_err(|e| refused(&e))?;
    // Handed over as they are, the memory of the core.
    let handed = |slopes: Vec<f64>| {
        let unknowns = slopes.len() / grid.len();
        slopes.into_pyarray(py).reshape([grid.len(), unknowns])
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
