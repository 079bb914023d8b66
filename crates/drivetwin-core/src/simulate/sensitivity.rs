// SPDX-License-Identifier: MIT
//! Exact forward derivatives of a dual-clutch run, through lock and break-away events.

use super::dual_clutch::{DualClutchRun, DualClutchStart, simulate_dual_clutch};
use super::run::{RunOptions, SimulateError};
use crate::model::dual_clutch::DualClutch;
use crate::number::{Dual, Number};
use crate::solver::{Settings, Signal, Status};
use thiserror::Error;

/// Most parameters that one pass differentiates for.
pub const LANES: usize = 16;
/// Most parameters of the narrow pass.
const FEW: usize = 8;

/// Reason why sensitivities cannot be computed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SensitivityError {
    /// A name that is no parameter.
    #[error(
        "parameter {name:?} is unknown; known are the fields of the model (eta, J1, load.constant, \
         B2.P0, B2.mu_c, ...), start.engine_speed, start.output_speed, start.wheel_speed, \
         start.twist and delay.<input>"
    )]
    Unknown {
        /// The name.
        name: String,
    },
    /// A parameter at a value where the motion has a corner.
    #[error(
        "nothing has a derivative by {name:?} at 0: what has no capacity holds nothing; give it a \
         small positive value"
    )]
    Corner {
        /// The name.
        name: String,
    },
    /// The scenario cannot be run.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

/// Sampled input.
#[derive(Clone, Copy, Debug)]
pub struct Sampled<'a> {
    /// Name.
    pub name: &'a str,
    /// Times, s.
    pub times: &'a [f64],
    /// Values, SI.
    pub values: &'a [f64],
    /// Delay, s.
    pub delay: f64,
}

/// A run with the derivatives of its columns and event times.
#[derive(Clone, Debug)]
pub struct Sensitivities {
    /// Values.
    pub run: DualClutchRun<f64>,
    /// Derivatives of every column, pass by pass: time × parameters of the pass, the last the fastest.
    /// All passes but the last are for [`LANES`] parameters; in that there may be room for more than
    /// were asked for, with zeros.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Derivative of every event time by every parameter: parameters × events.
    pub events: Vec<Vec<f64>>,
}

/// Simulate and differentiate by the named parameters. Derivatives are undefined where an event
/// grazes; event times differentiate implicitly.
pub fn dual_clutch_sensitivities(
    model: &DualClutch<f64>,
    signals: &[Sampled<'_>],
    start: &DualClutchStart<f64>,
    grid: &[f64],
    settings: Settings,
    parameters: &[&str],
) -> Result<Sensitivities, SensitivityError> {
    check_corners(parameters, model)?;
    let mut found: Option<Sensitivities> = None;
    // Without parameters one pass for the values.
    for k in 0..parameters.len().div_ceil(LANES).max(1) {
        let group = &parameters[k * LANES..parameters.len().min((k + 1) * LANES)];
        let Pass { run, columns, events } = if group.len() <= FEW {
            pass::<FEW>(model, signals, start, grid, settings, group)?
        } else {
            pass::<LANES>(model, signals, start, grid, settings, group)?
        };
        let all =
            found.get_or_insert_with(|| Sensitivities { run, columns: vec![], events: vec![] });
        all.columns.push(columns);
        all.events.extend(events);
    }
    Ok(found.expect("at least one pass"))
}

/// Refuse derivatives by a capacity of nothing.
pub(super) fn check_corners(
    parameters: &[&str],
    model: &DualClutch<f64>,
) -> Result<(), SensitivityError> {
    let name = "load.rolling";
    match parameters.contains(&name) && model.load.rolling == 0.0 {
        true => Err(SensitivityError::Corner { name: name.to_owned() }),
        false => Ok(()),
    }
}

/// A run with its derivatives by the parameters of one pass, as in [`Sensitivities`].
struct Pass {
    run: DualClutchRun<f64>,
    columns: Vec<Vec<f64>>,
    events: Vec<Vec<f64>>,
}

/// One pass for up to `P` parameters.
fn pass<const P: usize>(
    model: &DualClutch<f64>,
    signals: &[Sampled<'_>],
    start: &DualClutchStart<f64>,
    grid: &[f64],
    settings: Settings,
    parameters: &[&str],
) -> Result<Pass, SensitivityError> {
    let (model, start, delays) = seed_variables::<P>(model, signals, start, parameters)?;
    let inputs = apply_delays(signals, &delays);
    let dual =
        simulate_dual_clutch(&model, &inputs, &start, grid, RunOptions { settings, audit: false })?;
    if matches!(dual.status, Status::Interrupted { .. }) {
        return Err(SimulateError::Interrupted.into());
    }
    let of_lane = |lane| dual.events.iter().map(|e| e.time.eps[lane]).collect();
    let events: Vec<Vec<f64>> = (0..parameters.len()).map(of_lane).collect();
    let (run, columns) = dual.split_derivatives();
    Ok(Pass { run, columns, events })
}

/// Model, start and delays [s].
pub(super) type Variables<const P: usize> =
    (DualClutch<Dual<P>>, DualClutchStart<Dual<P>>, Vec<Dual<P>>);

/// Model, start and delays with the named parameters as variables, at most `P`.
pub(super) fn seed_variables<const P: usize>(
    model: &DualClutch<f64>,
    signals: &[Sampled<'_>],
    start: &DualClutchStart<f64>,
    parameters: &[&str],
) -> Result<Variables<P>, SensitivityError> {
    let mut model = model.promote::<Dual<P>>();
    let mut start = start.promote::<Dual<P>>();
    let mut delays: Vec<Dual<P>> = signals.iter().map(|s| Dual::of(s.delay)).collect();
    for (lane, &name) in parameters.iter().enumerate() {
        let place = match name.split_once('.') {
            Some(("start", field)) => start.field_mut(field),
            Some(("delay", input)) => {
                signals.iter().position(|s| s.name == input).map(|i| &mut delays[i])
            }
            _ => model.parameter_mut(name),
        };
        let place = place.ok_or_else(|| SensitivityError::Unknown { name: name.to_owned() })?;
        place.eps[lane] = 1.0;
    }
    Ok((model, start, delays))
}

/// The inputs with delays as variables.
pub(super) fn apply_delays<'a, const P: usize>(
    signals: &[Sampled<'a>],
    delays: &[Dual<P>],
) -> Vec<(&'a str, Signal<'a, Dual<P>>)> {
    let signal = |(&Sampled { name, times, values, .. }, &delay): (&Sampled<'a>, &Dual<P>)| {
        (name, Signal::Samples { times, values, delay })
    };
    signals.iter().zip(delays).map(signal).collect()
}
