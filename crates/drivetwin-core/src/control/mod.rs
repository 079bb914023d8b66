// SPDX-License-Identifier: MIT
//! Controllers in closed loop: commands of a shift by measured slip, and the actuators behind them.

mod actuator;
mod controller;
mod drive;
mod lag;
mod sensors;
mod shift_controller;
mod stroke;

pub use actuator::{Actuator, ActuatorModel};
pub use controller::{Commands, Controller, Measured, RunningController, Slips};
pub use drive::{ControlledUnit, Drive};
pub use sensors::{Sensors, SpeedSensor};
pub use shift_controller::{ControllerState, ShiftController};
