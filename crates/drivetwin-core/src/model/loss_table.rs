// SPDX-License-Identifier: MIT
//! Losses as data sheets state them: tables over speed and torque.

use super::declare::described;
use super::error::ModelError;
use super::torque_map::TorqueMap;

described! {
    /// Loss torque over speed and transmitted torque, bilinear between grid points.
    ///
    /// Below the first speed it falls in proportion to the speed, outside the grid the value at its border
    /// holds.
    pub struct LossTable {
        /// Magnitude of the speed, increasing.
        pub speed: Vec<f64> = Axis("rad/s").above(0.0),
        /// Torque that enters, increasing; positive where its power does. If none is negative, the table
        /// holds for both directions of power.
        pub torque: Vec<f64> = Axis("N·m"),
        /// Loss torque by torque (rows) and speed (columns). It must grow less than the torque.
        pub loss: Vec<Vec<f64>> = Rows("N·m").at_least(0.0),
    }
}

described! {
    /// Drag torque over the slip of a clutch, linear between points.
    ///
    /// Below the first point it falls in proportion to the slip, beyond the last it is constant.
    pub struct DragTable {
        /// Magnitude of the slip, increasing.
        pub slip: Vec<f64> = Axis("rad/s").above(0.0),
        /// Drag torque at each slip.
        pub torque: Vec<f64> = Axis("N·m").at_least(0.0),
    }
}

impl LossTable {
    pub(crate) fn check(&self, element: &str) -> Result<(), ModelError> {
        let fault = |problem| {
            Err(ModelError::Table { element: element.to_owned(), table: "losses", problem })
        };
        if !starts_above_zero(&self.speed) {
            return fault("must have speeds that increase from one above 0");
        }
        if self.torque.is_empty() || !increases(&self.torque) {
            return fault("must have torques that increase");
        }
        let shape = self.loss.len() == self.torque.len()
            && self.loss.iter().all(|row| row.len() == self.speed.len());
        if !shape {
            return fault("need one row per torque and one column per speed");
        }
        if !self.loss.iter().flatten().all(|&loss| loss.is_finite() && loss >= 0.0) {
            return fault("have a loss that is negative or not finite");
        }
        let steeper = |i: usize, j: usize| {
            self.loss[i][j] - self.loss[i - 1][j] >= self.torque[i] - self.torque[i - 1]
        };
        if (1..self.torque.len()).any(|i| (0..self.speed.len()).any(|j| steeper(i, j))) {
            return fault(
                "have a loss that grows by more than the torque: less than nothing would leave",
            );
        }
        Ok(())
    }

    /// The table from standstill on, over torques of both signs.
    pub(crate) fn map(&self) -> TorqueMap {
        let rows = self.torque.iter().zip(&self.loss);
        let mirrored = rows.clone().filter(|_| self.torque[0] >= 0.0).filter(|row| *row.0 > 0.0);
        let mirrored = mirrored.rev().map(|(&torque, loss)| (-torque, loss));
        let rows = mirrored.chain(rows.map(|(&torque, loss)| (torque, loss)));
        let (throttle, torque) = rows.map(|(torque, loss)| (torque, from_standstill(loss))).unzip();
        TorqueMap { throttle, speed: from_standstill(&self.speed), torque }
    }
}

impl DragTable {
    pub(crate) fn check(&self, element: &str) -> Result<(), ModelError> {
        let fault = |problem| {
            Err(ModelError::Table { element: element.to_owned(), table: "drag", problem })
        };
        if !starts_above_zero(&self.slip) {
            return fault("must have slips that increase from one above 0");
        }
        if self.torque.len() != self.slip.len() {
            return fault("needs as many torques as slips");
        }
        if !self.torque.iter().all(|&torque| torque.is_finite() && torque >= 0.0) {
            return fault("has a torque that is negative or not finite");
        }
        Ok(())
    }

    /// The table from standstill on, the same for every torque.
    pub(crate) fn map(&self) -> TorqueMap {
        let torque = vec![from_standstill(&self.torque)];
        TorqueMap { throttle: vec![0.0], speed: from_standstill(&self.slip), torque }
    }
}

fn from_standstill(values: &[f64]) -> Vec<f64> {
    [&[0.0][..], values].concat()
}

fn increases(axis: &[f64]) -> bool {
    axis.iter().all(|v| v.is_finite()) && axis.windows(2).all(|w| w[0] < w[1])
}

pub(super) fn starts_above_zero(axis: &[f64]) -> bool {
    axis.first().is_some_and(|&first| first > 0.0) && increases(axis)
}
