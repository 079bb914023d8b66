// SPDX-License-Identifier: MIT
//! Tables of the losses of gears: their cells.

use super::branch::{Branch, TURN_RTOL, widened};
use crate::model::Name;
use crate::model::torque_map::{TorqueMap, span_index};
use crate::number::Values;

/// A gear with a table of losses.
#[derive(Clone, Debug)]
pub struct TableLoss {
    /// Name for messages.
    pub element: Name,
    /// Index of its constraint.
    pub constraint: usize,
    /// Channel of its loss torque.
    pub channel: usize,
    /// Loss torque over torque and speed.
    pub map: TorqueMap,
}

impl TableLoss {
    /// Cell of a torque of zero at a slip [rad/s]; at rest the direction is that of `before`.
    pub fn cell_without_torque<V: Values>(&self, slip: V, before: Branch) -> Branch {
        let rest = 2.0 * TURN_RTOL * self.map.speed[1];
        let sign = match before {
            Branch::Loss { sign, .. } if slip.decide(|slip| slip.abs() <= rest) => sign,
            _ => slip.decide(|slip| if slip < 0.0 { -1.0 } else { 1.0 }),
        };
        let speed = slip.decide(|slip| span_index(&self.map.speed, (slip * sign).max(0.0)));
        Branch::Loss { sign, torque: span_index(&self.map.throttle, 0.0), speed }
    }

    /// The border of a cell that a torque [N·m] lies beyond, and the cell there.
    pub fn border_before<V: Values>(&self, cell: Branch, through: V) -> Option<(V, Branch)> {
        let Branch::Loss { sign, torque, speed } = cell else { return None };
        let (from, to) = self.map.cell(torque, speed).throttle;
        let (least, most) = widened(&self.map, (from, to));
        let along = through * sign;
        let (border, torque) = if along.decide(|along| along > most) {
            (to, torque + 1)
        } else if along.decide(|along| along < least) {
            (from, torque - 1)
        } else {
            return None;
        };
        Some((V::of(border * sign), Branch::Loss { sign, torque, speed }))
    }
}
