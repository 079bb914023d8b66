# SPDX-License-Identifier: MIT
"""Disturbance by an additional torque of the output shaft."""

from __future__ import annotations

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle


def build_shaft_disturbance(at: OperatingPoint, torque: FloatArray) -> Disturbance:
    """Build the action of an additional shaft torque (N,) [N m] on both of its ends and on the
    output torque that is measured there."""
    middle = compute_middle(torque)
    force = at.build_force(1, -middle) + at.build_force(2, at.model.i_f * middle)
    return Disturbance(force=force, outputs={OUTPUT_TORQUE: torque})
