# SPDX-License-Identifier: MIT
"""Result of an observer: torques over time with their standard deviations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.estimation.result.estimate import Z95
from drivetwin.shifts.shift import Shift

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Band:
    """A torque [N m] and one standard deviation of its error, both (n,)."""

    value: FloatArray
    std: FloatArray

    @property
    def lower(self) -> FloatArray:
        """Lower end of the 95 % band."""
        return self.value - Z95 * self.std

    @property
    def upper(self) -> FloatArray:
        """Upper end of the 95 % band."""
        return self.value + Z95 * self.std


@dataclass(frozen=True, eq=False)
class Observation:
    """The torques of one shift on `time` (n,) [s].

    `output_torque` is T_o of the shaft, `clutch_torque` goes by element and has the sign of its
    slip where it slips (THEORY section 3). `notes` list missing inputs and cuts of the gears before
    and after the shift.
    """

    shift: Shift
    time: FloatArray
    output_torque: Band
    clutch_torque: Mapping[str, Band]
    notes: tuple[str, ...] = ()

    @property
    def bands(self) -> dict[str, Band]:
        """Torques by the name of their channel: `output_torque`, `torque.<element>`."""
        clutches = {f"torque.{name}": band for name, band in self.clutch_torque.items()}
        return {"output_torque": self.output_torque, **clutches}
