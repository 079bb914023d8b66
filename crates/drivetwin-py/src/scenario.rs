// SPDX-License-Identifier: MIT
//! Drivelines, inputs and starts as Python names them.

use crate::border::refused;
use drivetwin_core::model::{Driveline, Element};
use drivetwin_core::number::Number;
use drivetwin_core::simulate::{Scenario, Seed, Start};
use drivetwin_core::solver::Signal;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use serde::de::DeserializeOwned;

/// Input name, sample times [s], values and delay [s].
pub type Samples<'py, T> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>, T);
/// Input name, offset, amplitude, frequency [Hz], phase [rad].
pub type Sine = (String, f64, f64, f64, f64);
/// Speeds [rad/s] by node, twists [rad] by shaft, names of elements at rest.
pub type NamedStart<T> = (Vec<(String, T)>, Vec<(String, T)>, Vec<String>);
/// Inputs and start.
pub type NamedScenario<'py> = ((Vec<Samples<'py, f64>>, Vec<Sine>), NamedStart<f64>);
/// Unknown, path of a number that depends on it, derivatives for all runs or for each.
pub type NamedSeed<'py> = (usize, String, PyReadonlyArray1<'py, f64>);

/// Read a driveline from its JSON, a list of elements.
pub fn parse<T: Number + DeserializeOwned>(driveline: &str) -> PyResult<Driveline<T>> {
    if let Ok(elements) = serde_json::from_str(driveline) {
        return Ok(Driveline { elements });
    }
    // One by one, so that a fault names its element.
    let refuse = |name: &str, e: serde_json::Error| refused(&format!("{name}: {e}"));
    let all: Vec<serde_json::Value> =
        serde_json::from_str(driveline).map_err(|e| refuse("elements", e))?;
    let element = |(i, value): (usize, serde_json::Value)| -> PyResult<Element<T>> {
        let name = value.get("name").and_then(|name| name.as_str());
        let name = name.map_or_else(|| format!("element {i}"), ToOwned::to_owned);
        serde_json::from_value(value).map_err(|e| refuse(&name, e))
    };
    let elements = all.into_iter().enumerate().map(element).collect::<PyResult<_>>()?;
    Ok(Driveline { elements })
}

/// Convert inputs and start to those of the core.
pub fn scenario_of<'s>(named: &'s NamedScenario<'_>) -> PyResult<Scenario<'s>> {
    let ((samples, sines), (speeds, twists, locked)) = named;
    let signals = signals_of(samples, sines, |&delay| Ok(delay))?;
    let (speeds, twists, locked) = (speeds.clone(), twists.clone(), locked.clone());
    Ok(Scenario { signals, start: Start { speeds, twists, locked } })
}

/// Convert inputs to those of the core; `delay_of` converts a delay [s].
pub fn signals_of<'s, D, T: Number>(
    samples: &'s [Samples<'_, D>],
    sines: &'s [Sine],
    delay_of: impl Fn(&D) -> PyResult<T>,
) -> PyResult<Vec<(&'s str, Signal<'s, T>)>> {
    let sampled = samples.iter().map(|(name, times, values, delay)| {
        let (times, values, delay) = (times.as_slice()?, values.as_slice()?, delay_of(delay)?);
        Ok((name.as_str(), Signal::Samples { times, values, delay }))
    });
    let sines = sines.iter().map(|&(ref name, offset, amplitude, frequency, phase)| {
        let (offset, amplitude) = (T::of(offset), T::of(amplitude));
        Ok((name.as_str(), Signal::Sine { offset, amplitude, frequency, phase }))
    });
    sampled.chain(sines).collect()
}

/// Convert the derivatives of numbers by unknowns to those of the core.
pub fn seeds_of<'s>(named: &'s [NamedSeed<'_>]) -> PyResult<Vec<Seed<'s>>> {
    let seed = |(unknown, path, weights): &'s NamedSeed<'_>| {
        Ok(Seed { unknown: *unknown, path, weights: weights.as_slice()? })
    };
    named.iter().map(seed).collect()
}

/// Borrow names.
pub fn names_of(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}
