// SPDX-License-Identifier: MIT
//! Controllers in closed loop: commands of a shift by measured slip, and the actuators behind them.

mod actuator;
mod drive;
mod lag;
mod shift_controller;
mod stroke;

pub use actuator::{Actuator, ActuatorModel};
pub use drive::{ControlledUnit, Drive};
pub use shift_controller::{Commands, ControllerState, ShiftController, Slips};
