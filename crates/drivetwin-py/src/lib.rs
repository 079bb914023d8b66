// SPDX-License-Identifier: MIT
//! Python binding: arrays in, arrays out, the interpreter released while the core works.
//!
//! Private to the package; `drivetwin.driveline` is its face.

use drivetwin_core::model::DualClutch;
use drivetwin_core::simulate::{DualClutchRun, DualClutchStart, EnergyAudit, simulate_dual_clutch};
use drivetwin_core::solve::{EventKind, Settings, Signal as SamplesOrSine};
use numpy::{PyArray2, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Name, times [s] and values of an input.
type Signal<'py> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);
/// Speeds of engine, output and wheel [rad/s], twist [rad], names of locked elements.
type Start = (f64, f64, f64, f64, Vec<String>);
/// Tolerance, longest step [s], fixed order, whether to audit the energy.
type Options = (f64, f64, Option<usize>, bool);
/// Time [s], element, kind.
type Event = (f64, String, &'static str);
/// Source, stored, friction, gear loss, shaft, load, converter, created, error [J].
type Audit = (f64, f64, f64, f64, f64, f64, f64, f64, f64);
/// Columns (n_columns, n_time), events, status, audit.
type Run<'py> = (Bound<'py, PyArray2<f64>>, Vec<Event>, String, Option<Audit>);

/// Simulate a dual-clutch driveline given as JSON; see `drivetwin.driveline.simulate`.
#[pyfunction]
fn simulate<'py>(
    py: Python<'py>,
    model: &str,
    signals: Vec<Signal<'py>>,
    start: Start,
    grid: PyReadonlyArray1<'py, f64>,
    options: Options,
) -> PyResult<Run<'py>> {
    let model: DualClutch<f64> =
        serde_json::from_str(model).map_err(|e| PyValueError::new_err(e.to_string()))?;
    let grid = grid.as_slice()?;
    let signals = signals
        .iter()
        .map(|(name, times, values)| {
            Ok((name.as_str(), SamplesOrSine::Samples(times.as_slice()?, values.as_slice()?)))
        })
        .collect::<PyResult<Vec<_>>>()?;
    let (engine_speed, output_speed, wheel_speed, twist, locked) = start;
    let start = DualClutchStart { engine_speed, output_speed, wheel_speed, twist, locked };
    let (tolerance, max_step, order, audit) = options;
    let settings = Settings { tolerance, max_step, order };
    let run = py
        .detach(|| simulate_dual_clutch(&model, &signals, &start, grid, (settings, audit)))
        .map_err(|e| PyValueError::new_err(e.to_string()))?;
    as_python(py, &run)
}

fn as_python<'py>(py: Python<'py>, run: &DualClutchRun<f64>) -> PyResult<Run<'py>> {
    let named = |event: &drivetwin_core::solve::Event<f64>| {
        (event.time, run.elements[event.element].clone(), kind_name(event.kind))
    };
    let events = run.events.iter().map(named).collect();
    let audit = run.audit.map(as_tuple);
    let columns = PyArray2::from_vec2(py, &run.columns)?;
    Ok((columns, events, run.status.to_string(), audit))
}

fn as_tuple(a: EnergyAudit) -> Audit {
    (a.source, a.stored, a.friction, a.gear_loss, a.shaft, a.load, a.converter, a.created, a.error)
}

fn kind_name(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Lock => "lock",
        EventKind::BreakAway => "break_away",
        EventKind::Reverse => "reverse",
        EventKind::Fill => "fill",
        EventKind::Vent => "vent",
    }
}

/// The compiled core.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(simulate, module)?)
}
