// SPDX-License-Identifier: MIT
//! Controller with its actuators: inputs of a driveline from slip.

use super::actuator::{Actuator, ActuatorModel};
use super::controller::{Commands, Controller, Measured, RunningController};
use super::sensors::{Sensing, Sensors};
use serde::{Deserialize, Serialize};

/// Actuators of a made unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlledUnit {
    /// Actuator of the off-going element.
    pub offgoing: ActuatorModel,
    /// Actuator of the on-coming element.
    pub oncoming: ActuatorModel,
    /// Time constant of the engine torque, s; none for an immediate one.
    pub engine_lag: f64,
    /// Sensors of the speeds that the controller has; none for exact speeds.
    pub sensors: Option<Sensors>,
}

/// Controller, actuators and engine in motion.
pub struct Drive<'c> {
    controller: Box<dyn RunningController + 'c>,
    offgoing: Actuator,
    oncoming: Actuator,
    sensing: Option<Sensing>,
    engine_lag: f64,
    engine_torque: f64,
    time: f64,
}

impl<'c> Drive<'c> {
    /// Drive at rest before the request, from a time [s] on; `step` [s] is the usual time between two inputs.
    pub fn new(given: &'c dyn Controller, unit: &ControlledUnit, time: f64, step: f64) -> Self {
        let controller = given.start();
        let Commands { engine_torque, offgoing, oncoming } = controller.commands();
        Self {
            controller,
            offgoing: Actuator::new(&unit.offgoing, offgoing, time, step),
            oncoming: Actuator::new(&unit.oncoming, oncoming, time, step),
            sensing: unit.sensors.map(Sensing::new),
            engine_lag: unit.engine_lag,
            engine_torque,
            time,
        }
    }

    /// Let the controller command by the quantities at the present time.
    pub fn command(&mut self, measured: &Measured) -> Commands {
        let sensed = self.sensing.as_mut().map(|one| one.sense(self.time, measured));
        let commands = self.controller.step(self.time, sensed.as_ref().unwrap_or(measured));
        self.offgoing.command(commands.offgoing);
        self.oncoming.command(commands.oncoming);
        commands
    }

    /// Inputs at the present time: engine torque [N·m] and pressures [Pa].
    pub fn inputs(&self) -> Commands {
        Commands {
            engine_torque: self.engine_torque,
            offgoing: self.offgoing.pressure(),
            oncoming: self.oncoming.pressure(),
        }
    }

    /// Move on to a later time [s] within the task; return the inputs there.
    pub fn advance(&mut self, to: f64) -> Commands {
        let wanted = self.controller.commands().engine_torque;
        let decay =
            if self.engine_lag > 0.0 { (-(to - self.time) / self.engine_lag).exp() } else { 0.0 };
        self.engine_torque = wanted + (self.engine_torque - wanted) * decay;
        self.offgoing.advance(to);
        self.oncoming.advance(to);
        self.time = to;
        self.inputs()
    }
}
