// SPDX-License-Identifier: MIT
//! Border between Python and the core: Ctrl-C ends a call, a panic becomes an exception.

use drivetwin_core::solver::with_interrupt;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::any::Any;
use std::cell::RefCell;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    /// Exception of the signal that interrupted the call of this thread.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// Call the core with the interpreter released. Signals of Python are handled meanwhile: where a handler
/// raises, runs end and its exception is raised. A panic raises `SimulationError`.
pub fn call<R: Send>(py: Python<'_>, work: impl FnOnce() -> R + Send) -> PyResult<R> {
    let result = py.detach(|| catch_unwind(AssertUnwindSafe(|| with_interrupt(has_raised, work))));
    if let Some(error) = RAISED.take() {
        return Err(error);
    }
    result.map_err(|panic| fault(py, &*panic))
}

/// Exception with the text of an error.
pub fn refused(error: &dyn Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Let Python handle its signals; true where a handler raises.
fn has_raised() -> bool {
    let handled = Python::try_attach(|py| py.check_signals());
    match handled {
        Some(Ok(())) => false,
        Some(Err(error)) => {
            RAISED.set(Some(error));
            true
        }
        // The interpreter ends.
        None => true,
    }
}

/// Exception of a panic.
fn fault(py: Python<'_>, panic: &(dyn Any + Send)) -> PyErr {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no text");
    let what = format!("the solver failed inside: {text}");
    let remedy = "report the elements, inputs and start of this run as a fault of the solver";
    let error = || {
        let class = py.import("drivetwin.errors")?.getattr("SimulationError")?;
        PyResult::Ok(PyErr::from_value(class.call1((what, remedy))?))
    };
    error().unwrap_or_else(|error| error)
}
