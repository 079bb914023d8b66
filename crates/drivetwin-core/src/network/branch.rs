// SPDX-License-Identifier: MIT
//! Analytic branches of torque laws and their boundaries.

use crate::model::torque_map::TorqueMap;
use crate::number::{Number, Series};

/// Analytic branch of a torque law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Branch {
    /// No torque.
    #[default]
    Off,
    /// Friction at rest relative to the other side, loaded to its static capacity.
    Saturated {
        /// Sign of the torque.
        sign: f64,
    },
    /// Moving in one direction, on piece `piece` of a table.
    Moving {
        /// Sign of the speed.
        sign: f64,
        /// Piece of the table, 0 without one.
        piece: usize,
    },
    /// Spans of throttle and speed of a torque map.
    Map {
        /// Throttle span.
        throttle: usize,
        /// Speed span.
        speed: usize,
    },
    /// Span of the speed ratio of a converter.
    Converter {
        /// Index of the span.
        index: usize,
        /// Sign of the pump speed: turning backwards, its torques are those of a mirror.
        sign: f64,
    },
    /// Direction of the road below a tyre.
    Slip {
        /// Its sign; 0 below the least speed.
        sign: f64,
    },
    /// Spans of torque and speed of a table of losses.
    Loss {
        /// Sign of the slip.
        sign: f64,
        /// Torque span, of the torque in the direction of the slip.
        torque: usize,
        /// Speed span.
        speed: usize,
    },
    /// Region of a piecewise linear compliance.
    Region {
        /// Its index.
        index: usize,
    },
}

/// A boundary of a branch: a series that must stay positive, and the branch beyond.
pub type BranchBoundary<T> = (Series<T>, Branch);

/// Slip backwards at which a gear or clutch with a table of losses turns round, relative to the first slip of the
/// table: at rest its direction is round-off.
pub(super) const TURN_RTOL: f64 = 1e-9;

/// Distance beyond a border up to which a torque counts to its cell, relative to the largest torque of the table: a
/// torque that stays on a border is on either side of it by round-off.
const BORDER_RTOL: f64 = 1e-11;

/// Torques [N·m] that count to a span of a table of losses when its cell is chosen.
pub(super) fn widened(map: &TorqueMap, (from, to): (f64, f64)) -> (f64, f64) {
    let largest = map.throttle.iter().fold(0.0, |largest: f64, torque| largest.max(torque.abs()));
    (from - BORDER_RTOL * largest, to + BORDER_RTOL * largest)
}

/// Boundaries of a table of losses, over a slip and, if it counts, a torque in the direction of the branch.
pub(super) fn loss_boundaries<T: Number>(
    map: &TorqueMap,
    branch: Branch,
    slip: &Series<T>,
    through: Option<Series<T>>,
) -> Vec<BranchBoundary<T>> {
    let Branch::Loss { sign, torque, speed } = branch else { return Vec::new() };
    let cell = map.cell(torque, speed);
    let (from, to) = cell.speed;
    let from = if speed == 1 { -TURN_RTOL * to } else { from };
    let along = between(slip, (from, to)).map(|(border, step)| {
        let turned = step < 0 && speed == 1;
        let speed = if turned { 1 } else { speed.wrapping_add_signed(step) };
        (border, Branch::Loss { sign: if turned { -sign } else { sign }, torque, speed })
    });
    let mut boundaries: Vec<_> = along.collect();
    if let Some(through) = through {
        // Once more, so that a cell that has just been chosen is not left at once.
        let span = widened(map, widened(map, cell.throttle));
        boundaries.extend(between(&through, span).map(|(border, step)| {
            let torque = torque.wrapping_add_signed(step);
            (border, Branch::Loss { sign, torque, speed })
        }));
    }
    boundaries
}

/// Boundaries of a tyre on a road of speed `road` in direction `sign`, 0 below the least speed.
pub(super) fn slip_boundaries<T: Number>(
    road: &Series<T>,
    least_speed: f64,
    sign: f64,
) -> Vec<BranchBoundary<T>> {
    if sign == 0.0 {
        let ends = between(road, (-least_speed, least_speed));
        return ends.map(|(border, step)| (border, Branch::Slip { sign: step as f64 })).collect();
    }
    let mut border = scaled(road, sign);
    border[0] -= T::of(least_speed);
    vec![(border, Branch::Slip { sign: 0.0 })]
}

pub(super) fn scaled<T: Number>(series: &Series<T>, factor: f64) -> Series<T> {
    series.map(|c| c * factor)
}

pub(super) fn add_weighted<T: Number>(a: &Series<T>, wa: T, b: &Series<T>, wb: T) -> Series<T> {
    std::array::from_fn(|k| a[k] * wa + b[k] * wb)
}

/// Distances to the ends of a span that exist, each with the step to the neighbouring branch.
pub(super) fn between<T: Number>(
    series: &Series<T>,
    span: (f64, f64),
) -> impl Iterator<Item = (Series<T>, isize)> {
    let mut above = *series;
    above[0] -= span.0;
    let mut below = scaled(series, -1.0);
    below[0] += span.1;
    let finite = [(span.0, (above, -1)), (span.1, (below, 1))];
    finite.into_iter().filter(|(end, _)| end.is_finite()).map(|(_, border)| border)
}
