// SPDX-License-Identifier: MIT
//! Recorded quantities as Python names them.

use drivetwin_core::simulate::Output;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use serde_json::{from_value, json};

/// Kind, and the name of the node or element; a torque has the names of its element and node.
pub type NamedOutput = (String, Vec<String>);

/// Convert outputs to those of the core.
pub fn outputs_of(named: &[NamedOutput]) -> PyResult<Vec<Output>> {
    let convert = |(kind, names): &NamedOutput| {
        let stated = match &names[..] {
            [name] => json!({ kind: name }),
            _ => json!({ kind: names }),
        };
        let refuse = |_| PyValueError::new_err(format!("no output is a {kind} of {names:?}"));
        from_value(stated).map_err(refuse)
    };
    named.iter().map(convert).collect()
}
