// SPDX-License-Identifier: MIT
//! Gears and shifts of a gearbox: driveline as JSON in, plain data out.

use crate::border::call;
use drivetwin_core::model::{Driveline, Mechanism};
use drivetwin_core::network::mobility::EngagedError;
use drivetwin_core::network::reduction::{ElementRatios, Exchange, Reduction};
use drivetwin_core::network::statics::Statics;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::fmt::Display;

/// Member and its speed per unit input speed, `None` where it idles.
type MemberSpeed = (String, Option<f64>);
/// Element, member, torque on the member per unit input torque.
type FlangeTorque = (String, String, f64);
/// Speeds, torques, largest imbalance of power and of torque.
type Gear = (Vec<MemberSpeed>, Vec<FlangeTorque>, (f64, f64));
/// Element, i_c, i_out, sense of the slip.
type Ratios = (String, f64, f64, f64);
/// Member, inertia [kg m²], a, b with `ω = a ω_in - b ω_out`.
type Member = (String, f64, f64, f64);
/// Off-going, on-coming, common elements, members.
type Shift = (Ratios, Ratios, Vec<String>, Vec<Member>);

fn refused(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn mechanism(driveline: &str) -> PyResult<Mechanism<f64>> {
    let driveline: Driveline<f64> = serde_json::from_str(driveline).map_err(refused)?;
    driveline.mechanism().map_err(refused)
}

/// Speeds and torques of a gear; see `drivetwin.gearbox.Gearbox.gear`.
#[pyfunction]
pub fn gear_statics(
    py: Python<'_>,
    driveline: &str,
    engaged: Vec<String>,
    input: &str,
    output: &str,
) -> PyResult<Gear> {
    let mechanism = mechanism(driveline)?;
    let (gear, imbalance) = call(py, || {
        let gear = Statics::solve(&mechanism, &engaged, input, output)?;
        let imbalance = gear.imbalance(input, output);
        Ok::<_, EngagedError>((gear, imbalance))
    })?
    .map_err(refused)?;
    let torques = gear.flanges.into_iter().map(|f| (f.element, f.member, f.torque)).collect();
    Ok((gear.speeds, torques, imbalance))
}

/// Dual-clutch form of the shift between two sets of elements; see `drivetwin.gearbox.reduce`.
#[pyfunction]
pub fn reduce_shift(
    py: Python<'_>,
    driveline: &str,
    from_elements: Vec<String>,
    to_elements: Vec<String>,
    dogs: Vec<String>,
    ends: (String, String),
) -> PyResult<Shift> {
    let mechanism = mechanism(driveline)?;
    let shift = call(py, || {
        let exchange = Exchange::between(&from_elements, &to_elements, &dogs)?;
        Reduction::of(&mechanism, &exchange, &ends.0, &ends.1)
    })?
    .map_err(refused)?;
    let members = shift.members.into_iter().map(|m| (m.member, m.inertia, m.a, m.b)).collect();
    Ok((ratios(shift.off_going), ratios(shift.on_coming), shift.common, members))
}

fn ratios(of: ElementRatios<f64>) -> Ratios {
    (of.element, of.i_c, of.i_out, of.sense)
}
