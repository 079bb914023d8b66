// SPDX-License-Identifier: MIT
//! Interface of shift controllers: commands at a task by measured quantities.

use std::fmt::{self, Debug};

/// Slips of both elements, rad/s.
#[derive(Clone, Copy, Debug)]
pub struct Slips {
    /// Of the off-going element.
    pub offgoing: f64,
    /// Of the on-coming element.
    pub oncoming: f64,
}

/// Quantities measured at a task.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Slips of both elements.
    pub slips: Slips,
    /// Speed of the engine, rad/s; NaN where the run has no node for it.
    pub engine_speed: f64,
    /// Speed of the gearbox output, rad/s; NaN where the run has no node for it.
    pub output_speed: f64,
}

/// Commands of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Commands {
    /// N·m.
    pub engine_torque: f64,
    /// Pa.
    pub offgoing: f64,
    /// Pa.
    pub oncoming: f64,
}

impl Commands {
    /// Return whether all commands are finite.
    pub fn are_finite(&self) -> bool {
        self.engine_torque.is_finite() && self.offgoing.is_finite() && self.oncoming.is_finite()
    }
}

/// Shift controller.
pub trait Controller: Debug + Sync {
    /// Start the controller before the request, for one run.
    fn start(&self) -> Box<dyn RunningController + '_>;
}

/// Controller in motion.
pub trait RunningController {
    /// Last commands; before the first task those of the old gear.
    fn commands(&self) -> Commands;

    /// Command at a task at a time [s], by the quantities then.
    fn step(&mut self, time: f64, measured: &Measured) -> Commands;
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { slips, engine_speed, output_speed } = self;
        write!(
            f,
            "slips {:.6} and {:.6} rad/s, engine {engine_speed:.6} rad/s, output {output_speed:.6} rad/s",
            slips.offgoing, slips.oncoming
        )
    }
}
