// SPDX-License-Identifier: MIT
//! Recorded quantities as Python names them.

use crate::border::refused;
use drivetwin_core::simulate::Output;
use pyo3::prelude::*;

/// Kind, and the name of the node or element; a torque has the names of its element and node.
pub type NamedOutput = (String, Vec<String>);

/// Convert outputs to those of the core.
pub fn outputs_of(named: &[NamedOutput]) -> PyResult<Vec<Output>> {
    named.iter().map(|(kind, names)| output_of(kind, names)).collect()
}

fn output_of(kind: &str, names: &[String]) -> PyResult<Output> {
    let convert: fn(String) -> Output = match (kind, names) {
        ("torque", [element, node]) => return Ok(Output::Torque(element.clone(), node.clone())),
        ("speed", [_]) => Output::Speed,
        ("acceleration", [_]) => Output::Acceleration,
        ("angle", [_]) => Output::Angle,
        ("twist", [_]) => Output::Twist,
        ("shaft_torque", [_]) => Output::ShaftTorque,
        ("slip", [_]) => Output::Slip,
        ("friction_torque", [_]) => Output::FrictionTorque,
        ("power", [_]) => Output::Power,
        ("loss", [_]) => Output::Loss,
        ("work", [_]) => Output::Work,
        ("heat", [_]) => Output::Heat,
        ("energy", [_]) => Output::Energy,
        _ => return Err(refused(&format!("no output is a {kind} of {names:?}"))),
    };
    Ok(convert(names[0].clone()))
}
