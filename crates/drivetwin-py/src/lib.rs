// SPDX-License-Identifier: MIT
//! Python binding: arrays in, arrays out, the interpreter released while the core works.
//!
//! Private to the package; the Python modules of the same names are its face.

mod actuator;
mod batch;
mod border;
mod controlled;
mod external_controller;
mod gearbox;
mod linear;
mod network;
mod network_sensitivity;
mod output;
mod plain;
mod response;
mod scenario;
mod table;
mod whitening;

use pyo3::prelude::*;

/// Compiling a network and passing an event take some hundred small blocks, in several threads.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The compiled core.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(batch::simulate_batch, module)?)?;
    module.add_function(wrap_pyfunction!(batch::batch_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(controlled::simulate_controlled, module)?)?;
    module.add_function(wrap_pyfunction!(actuator::actuator_pressure, module)?)?;
    module.add_function(wrap_pyfunction!(linear::linearise, module)?)?;
    module.add_function(wrap_pyfunction!(network::simulate_network, module)?)?;
    module.add_function(wrap_pyfunction!(network::element_schema, module)?)?;
    module.add_function(wrap_pyfunction!(network_sensitivity::network_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(response::network_response, module)?)?;
    module.add_function(wrap_pyfunction!(gearbox::gear_statics, module)?)?;
    module.add_function(wrap_pyfunction!(gearbox::reduce_shift, module)?)?;
    module.add_function(wrap_pyfunction!(whitening::whiten, module)?)?;
    module.add("LANES", drivetwin_core::simulate::LANES)?;
    module.add_class::<table::TableScanner>()?;
    module.add_class::<table::ScannedTable>()?;
    Ok(())
}
