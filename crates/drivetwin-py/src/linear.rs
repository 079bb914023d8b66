// SPDX-License-Identifier: MIT
//! The linear system about an operating point; see `drivetwin.simulation.linearize`.

use crate::border::{call, refused};
use crate::output::{NamedOutput, outputs_of};
use crate::scenario::parse;
use drivetwin_core::network::Network;
use drivetwin_core::network::linalg::Matrix;
use drivetwin_core::simulate::{Slipping, linearise as linearised};
use numpy::PyArray2;
use pyo3::prelude::*;

/// A, B, C, D and the names of states and inputs.
type System<'py> = ([Bound<'py, PyArray2<f64>>; 4], Vec<String>, Vec<String>);

/// Linearise a driveline, given as JSON: that of a dual clutch or a list of elements. Slipping elements
/// are name, slip [rad/s] and pressure [Pa].
#[pyfunction]
pub fn linearise<'py>(
    py: Python<'py>,
    driveline: &str,
    locked: Vec<String>,
    slipping: Vec<(String, f64, f64)>,
    outputs: Vec<NamedOutput>,
) -> PyResult<System<'py>> {
    let (driveline, outputs) = (parse(driveline)?, outputs_of(&outputs)?);
    let slipping: Vec<Slipping> = slipping
        .into_iter()
        .map(|(element, slip, pressure)| Slipping { element, slip, pressure })
        .collect();
    let system = call(py, || {
        let network = Network::compile(&driveline)?;
        linearised(&network, &locked, &slipping, &outputs)
    })?
    .map_err(|e| refused(&e))?;
    let array = |m: &Matrix<f64>| {
        let rows: Vec<Vec<f64>> = (0..m.rows).map(|i| m.row(i).to_vec()).collect();
        PyArray2::from_vec2(py, &rows)
    };
    let matrices = [array(&system.a)?, array(&system.b)?, array(&system.c)?, array(&system.d)?];
    Ok((matrices, system.states, system.inputs))
}
