// SPDX-License-Identifier: MIT
//! A run of the dual-clutch driveline with its usual outputs.

use super::output::Output;
use super::run::{Plan, RunOptions, SimulateError};
use super::start::{StartError, State, state_of};
use super::trajectory::Trajectory;
use crate::model::dual_clutch::{DualClutch, ENGINE, OUTPUT, SHAFT, WHEEL};
use crate::network::Network;
use crate::number::{Number, Real};
use crate::solver::Signal;

/// Start of a dual-clutch run.
#[derive(Clone, Debug)]
pub struct DualClutchStart<T> {
    /// rad/s.
    pub engine_speed: T,
    /// rad/s.
    pub output_speed: T,
    /// rad/s.
    pub wheel_speed: T,
    /// Twist of the output shaft, rad.
    pub twist: T,
    /// Elements without slip.
    pub locked: Vec<String>,
}

/// Trajectory whose columns are engine, output and wheel speed, twist, shaft torque, then torque
/// and slip of each shift element.
pub type DualClutchRun<T> = Trajectory<T>;

/// Simulate the dual-clutch driveline (paper eqs. 2-9).
pub fn simulate_dual_clutch<T: Real>(
    model: &DualClutch<T>,
    signals: &[(&str, Signal<'_, T>)],
    start: &DualClutchStart<T>,
    grid: &[f64],
    options: RunOptions,
) -> Result<DualClutchRun<T>, SimulateError> {
    let network = Network::compile(&model.driveline())?;
    let plan = Plan::new(&network, signals, grid, &dual_clutch_outputs(model), options)?;
    Ok(plan.run(&network, &start.state(&network)?))
}

/// [`simulate_dual_clutch`] over plain numbers, compiled once for all callers.
pub fn run_dual_clutch(
    model: &DualClutch<f64>,
    signals: &[(&str, Signal<'_, f64>)],
    start: &DualClutchStart<f64>,
    grid: &[f64],
    options: RunOptions,
) -> Result<DualClutchRun<f64>, SimulateError> {
    simulate_dual_clutch(model, signals, start, grid, options)
}

/// The usual outputs, see [`DualClutchRun`].
pub fn dual_clutch_outputs<T>(model: &DualClutch<T>) -> Vec<Output> {
    let mut outputs = vec![
        Output::Speed(ENGINE.into()),
        Output::Speed(OUTPUT.into()),
        Output::Speed(WHEEL.into()),
        Output::Twist(SHAFT.into()),
        Output::ShaftTorque(SHAFT.into()),
    ];
    for element in &model.elements {
        outputs.push(Output::FrictionTorque(element.name.to_string()));
        outputs.push(Output::Slip(element.name.to_string()));
    }
    outputs
}

impl<T: Number> DualClutchStart<T> {
    /// The state of a network of the dual clutch.
    pub fn state(&self, network: &Network<T>) -> Result<State<T>, StartError> {
        let speeds =
            [(ENGINE, self.engine_speed), (OUTPUT, self.output_speed), (WHEEL, self.wheel_speed)];
        state_of(network, &speeds, &[(SHAFT, self.twist)], &self.locked)
    }
}

impl DualClutchStart<f64> {
    /// Convert the start to another number type.
    pub fn promote<T: Number>(&self) -> DualClutchStart<T> {
        Self::from_lanes(|_| self)
    }

    /// The starts of runs by their numbers; elements without slip are those of run 0.
    pub(super) fn from_lanes<'s, T: Number>(of: impl Fn(usize) -> &'s Self) -> DualClutchStart<T> {
        DualClutchStart {
            engine_speed: T::from_lanes(|run| of(run).engine_speed),
            output_speed: T::from_lanes(|run| of(run).output_speed),
            wheel_speed: T::from_lanes(|run| of(run).wheel_speed),
            twist: T::from_lanes(|run| of(run).twist),
            locked: of(0).locked.clone(),
        }
    }
}

impl<T> DualClutchStart<T> {
    /// A number of the start by its name.
    pub fn field_mut(&mut self, name: &str) -> Option<&mut T> {
        Some(match name {
            "engine_speed" => &mut self.engine_speed,
            "output_speed" => &mut self.output_speed,
            "wheel_speed" => &mut self.wheel_speed,
            "twist" => &mut self.twist,
            _ => return None,
        })
    }
}
