// SPDX-License-Identifier: MIT
//! Exact derivatives of the runs of any network; see `drivetwin.simulation.network_sensitivity`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::plain::{Event, events_of, status_of};
use crate::scenario::{NamedStart, Samples, Sine, parse, signals_of};
use drivetwin_core::network::Network;
use drivetwin_core::number::Dual;
use drivetwin_core::simulate::{RunOptions, SimulateError, Start, run};
use drivetwin_core::solver::Settings;
use numpy::{IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;

/// Most unknowns of a narrow pass.
const FEW: usize = 8;
/// Most unknowns of a pass.
const MANY: usize = 16;
/// Value and the weights of its derivatives by lanes.
type Seeded = (f64, Vec<(usize, f64)>);
/// Columns (n_outputs, n_time), events, status, derivatives of every column (n_time, lanes) and of every
/// event time (n_events, lanes).
type Found<'py> = (
    Bound<'py, PyArray2<f64>>,
    Vec<Event>,
    String,
    Vec<Bound<'py, PyArray2<f64>>>,
    Bound<'py, PyArray2<f64>>,
);

/// Tolerance, longest step [s], number of unknowns.
type Options = (f64, f64, usize);

/// Simulate a driveline given as JSON and differentiate by its seeded numbers, at most [`MANY`] unknowns.
#[pyfunction]
pub fn network_sensitivities<'py>(
    py: Python<'py>,
    driveline: &str,
    outputs: Vec<NamedOutput>,
    signals: (Vec<Samples<'py, Seeded>>, Vec<Sine>),
    start: NamedStart<Seeded>,
    grid: PyReadonlyArray1<'py, f64>,
    options: Options,
) -> PyResult<Found<'py>> {
    let given = (signals, start, grid);
    match options.2 {
        ..=FEW => differentiate::<FEW>(py, driveline, &outputs, given, options),
        _ => differentiate::<MANY>(py, driveline, &outputs, given, options),
    }
}

/// Inputs, start and grid.
type Given<'py> =
    ((Vec<Samples<'py, Seeded>>, Vec<Sine>), NamedStart<Seeded>, PyReadonlyArray1<'py, f64>);

fn differentiate<'py, const P: usize>(
    py: Python<'py>,
    driveline: &str,
    outputs: &[NamedOutput],
    (signals, start, grid): Given<'py>,
    options: Options,
) -> PyResult<Found<'py>> {
    let (driveline, outputs) = (parse::<Dual<P>>(driveline)?, outputs_of(outputs)?);
    let grid = grid.as_slice()?;
    let inputs = signals_of(&signals.0, &signals.1, seed)?;
    let (speeds, twists, locked) = start;
    let start = Start { speeds: seed_all(speeds)?, twists: seed_all(twists)?, locked };
    let (tolerance, max_step, _) = options;
    let settings = Settings { tolerance, max_step, ..Settings::default() };
    let options = RunOptions { settings, audit: false };
    let found = call(py, || -> Result<_, SimulateError> {
        run(&Network::compile(&driveline)?, &inputs, &start, grid, &outputs, options)
    })?
    .map_err(|e| refused(&e))?;
    let times: Vec<Vec<f64>> = found.events.iter().map(|e| e.time.eps.to_vec()).collect();
    let (run, slopes) = found.split_derivatives();
    let handed = |slopes: Vec<f64>| slopes.into_pyarray(py).reshape([grid.len(), P]);
    Ok((
        PyArray2::from_vec2(py, &run.columns)?,
        events_of(&run),
        status_of(&run),
        slopes.into_iter().map(handed).collect::<PyResult<_>>()?,
        PyArray2::from_vec2(py, &times)?,
    ))
}

fn seed<const P: usize>((value, seeds): &Seeded) -> PyResult<Dual<P>> {
    let refuse = |lane| refused(&format!("lane {lane} is beyond {P}"));
    Dual::from_seeds(*value, seeds).map_err(refuse)
}

fn seed_all<const P: usize>(named: Vec<(String, Seeded)>) -> PyResult<Vec<(String, Dual<P>)>> {
    named.into_iter().map(|(name, number)| Ok((name, seed(&number)?))).collect()
}
