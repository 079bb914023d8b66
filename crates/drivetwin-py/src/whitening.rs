// SPDX-License-Identifier: MIT
//! Whitening of residual columns; see `drivetwin.estimation.likelihood.noise`.

use crate::border::call;
use drivetwin_core::solver::{BandedFactor, Whitening};
use numpy::{
    IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// Rows of the samples (n, S), their first states (n,) and variances (n,).
type Samples<'py> =
    (PyReadonlyArray2<'py, f64>, PyReadonlyArray1<'py, u32>, PyReadonlyArray1<'py, f64>);

/// Apply the inverse covariance to columns (n, q), with a lower banded Cholesky factor (bands, states).
#[pyfunction]
pub fn whiten<'py>(
    py: Python<'py>,
    factor: PyReadonlyArray2<'py, f64>,
    samples: Samples<'py>,
    columns: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (rows, first, variance) = &samples;
    let shape @ [_, count] = [columns.shape()[0], columns.shape()[1]];
    let whitening = Whitening {
        factor: BandedFactor { bands: factor.as_slice()?, size: factor.shape()[1] },
        states: rows.shape()[1],
        rows: rows.as_slice()?,
        first: first.as_slice()?,
        variance: variance.as_slice()?,
    };
    let columns = columns.as_slice()?;
    let found = call(py, move || whitening.apply(columns, count))?;
    found.into_pyarray(py).reshape(shape)
}
