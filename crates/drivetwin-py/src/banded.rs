// SPDX-License-Identifier: MIT
//! Banded systems of many columns; see `drivetwin.estimation.likelihood.noise`.

use crate::border::call;
use drivetwin_core::solver::BandedFactor;
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// Solve for the columns (n, q) with a lower banded Cholesky factor (bands, n).
#[pyfunction]
pub fn solve_banded<'py>(
    py: Python<'py>,
    factor: PyReadonlyArray2<'py, f64>,
    columns: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (size, count) = (factor.shape()[1], columns.shape()[1]);
    let bands = factor.as_slice()?;
    let mut found = columns.as_slice()?.to_vec();
    let found = call(py, move || {
        BandedFactor { bands, size }.solve(&mut found, count);
        found
    })?;
    numpy::PyArray1::from_vec(py, found).reshape([size, count])
}
