# SPDX-License-Identifier: MIT
"""Signals and errors by which two models of one shift are compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray


@dataclass(frozen=True)
class CouplingError:
    """Largest differences between full gearbox and dual-clutch form over a shift.

    `shaft_torque` [N m], `input_speed` and `output_speed` [rad/s].
    """

    shaft_torque: float
    input_speed: float
    output_speed: float


@dataclass(frozen=True, eq=False)
class Traces:
    """Shaft torque [N m], speeds of input and output [rad/s] of one model; arrays (n,)."""

    shaft_torque: FloatArray
    input_speed: FloatArray
    output_speed: FloatArray

    def compute_largest_difference(self, other: Traces) -> CouplingError:
        """Compare with another model over the same times."""
        return CouplingError(
            shaft_torque=float(np.max(np.abs(self.shaft_torque - other.shaft_torque))),
            input_speed=float(np.max(np.abs(self.input_speed - other.input_speed))),
            output_speed=float(np.max(np.abs(self.output_speed - other.output_speed))),
        )
