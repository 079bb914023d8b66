// SPDX-License-Identifier: MIT
//! Torque over throttle and speed, bilinear between grid points (paper eq. 2).

use super::declare::described;
use super::error::ModelError;

described! {
    /// Steady-state map of an engine. Outside the grid the border value of the border cell holds.
    pub struct TorqueMap {
        /// Throttle positions, increasing.
        pub throttle: Vec<f64> = Axis(),
        /// Engine speeds, increasing.
        pub speed: Vec<f64> = Axis("rad/s"),
        /// Torque by throttle (rows) and speed (columns).
        pub torque: Vec<Vec<f64>> = Rows("N·m"),
    }
}

/// One cell: `t00 + t10 θ + t01 ω + t11 θ ω`, valid within the spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Constant part, N·m.
    pub t00: f64,
    /// Per throttle.
    pub t10: f64,
    /// Per speed.
    pub t01: f64,
    /// Per throttle and speed.
    pub t11: f64,
    /// Throttle span.
    pub throttle: (f64, f64),
    /// Speed span, rad/s.
    pub speed: (f64, f64),
}

/// Index of a span on an axis: 0 lies below the first point, `len` beyond the last.
pub fn span_index(axis: &[f64], value: f64) -> usize {
    axis.partition_point(|&x| x <= value)
}

impl TorqueMap {
    /// The cell of throttle span `i` and speed span `j` (see [`span_index`]).
    pub fn cell(&self, i: usize, j: usize) -> Cell {
        let ((i0, i1), throttle) = corners(&self.throttle, i);
        let ((j0, j1), speed) = corners(&self.speed, j);
        let (a0, da) = (self.throttle[i0], self.throttle[i1] - self.throttle[i0]);
        let (b0, db) = (self.speed[j0], self.speed[j1] - self.speed[j0]);
        let at = |p: usize, q: usize| self.torque[p][q];
        let per = |difference: f64, width: f64| if width > 0.0 { difference / width } else { 0.0 };
        let along_a = per(at(i1, j0) - at(i0, j0), da);
        let along_b = per(at(i0, j1) - at(i0, j0), db);
        let twist = per(per(at(i1, j1) - at(i1, j0) - at(i0, j1) + at(i0, j0), da), db);
        Cell {
            t00: at(i0, j0) - along_a * a0 - along_b * b0 + twist * a0 * b0,
            t10: along_a - twist * b0,
            t01: along_b - twist * a0,
            t11: twist,
            throttle,
            speed,
        }
    }

    pub(crate) fn check(&self, element: &str) -> Result<(), ModelError> {
        let fault = |problem| {
            Err(ModelError::Table { element: element.to_owned(), table: "torque map", problem })
        };
        let increases = |axis: &[f64]| !axis.is_empty() && axis.windows(2).all(|w| w[0] < w[1]);
        if !increases(&self.throttle) || !increases(&self.speed) {
            return fault("must have axes that increase");
        }
        let shape = self.torque.len() == self.throttle.len()
            && self.torque.iter().all(|row| row.len() == self.speed.len());
        if !shape {
            return fault("needs one row per throttle position and one column per speed");
        }
        if !self.torque.iter().flatten().all(|t| t.is_finite()) {
            return fault("has a torque that is not finite");
        }
        Ok(())
    }
}

fn corners(axis: &[f64], i: usize) -> ((usize, usize), (f64, f64)) {
    let last = axis.len() - 1;
    match i {
        0 => ((0, 0), (f64::NEG_INFINITY, axis[0])),
        i if i > last => ((last, last), (axis[last], f64::INFINITY)),
        i => ((i - 1, i), (axis[i - 1], axis[i])),
    }
}
