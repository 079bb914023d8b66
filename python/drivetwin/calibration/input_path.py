# SPDX-License-Identifier: MIT
"""Path from the commanded profiles of a shift to the engine torque and pressures that act."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin._util.arrays import FloatArray, apply_lag
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, ShiftElement, Signal
from drivetwin.twin.twin import (
    CAPACITY_REFERENCE,
    CAPACITY_SLOPE,
    PRESSURE_DELAY,
    TORQUE_LAG,
    TORQUE_SHIFT,
    Twin,
)

_SHORTEST_LAG = 1e-6
"""Lag [s] below which there is none: far below every sampling step."""


@dataclass(frozen=True)
class CapacitySlope:
    """Capacity of an element that departs from proportion to the pressure above P0.

    It is multiplied by 1 + `slope`·(x - 1/2), where x is the pressure above P0 over `reference`
    [Pa], at most 1: `slope` is the relative change of the friction coefficient over that range.
    """

    slope: float
    reference: float

    def apply(self, pressure: FloatArray, contact: float) -> FloatArray:
        """Return the pressure (n,) [Pa] that has this capacity by the proportional law.

        `contact` is P0 [Pa].
        """
        above = np.maximum(pressure - contact, 0.0)
        share = np.minimum(above / self.reference, 1.0)
        return np.asarray(pressure + self.slope * (share - 0.5) * above)


@dataclass(frozen=True)
class InputPath:
    """Delays of pressures and engine torque [s], lag of the latter [s], capacity by shift element.

    A path of the inputs leaves the simulation itself as it is.
    """

    pressure_delay: float = 0.0
    torque_lag: float = 0.0
    torque_shift: float = 0.0
    slopes: Mapping[str, CapacitySlope] = field(default_factory=dict)

    @classmethod
    def from_twin(cls, twin: Twin) -> InputPath:
        """Build the path that a twin has learned; direct without one."""
        slopes = {}
        for name in twin.elements:
            slope = twin.get_value(f"{CAPACITY_SLOPE}.{name}", 0.0)
            reference = twin.get_value(f"{CAPACITY_REFERENCE}.{name}", 0.0)
            if slope != 0.0 and reference > 0.0:
                slopes[name] = CapacitySlope(slope, reference)
        names = (PRESSURE_DELAY, TORQUE_LAG, TORQUE_SHIFT)
        delay, lag, shift = (twin.get_value(name, 0.0) for name in names)
        return cls(delay, lag, shift, slopes)

    def apply(
        self,
        engine_torque: Signal,
        pressures: Mapping[str, Signal],
        elements: Sequence[ShiftElement],
        time: FloatArray,
    ) -> dict[str, Signal]:
        """Return the acting inputs by name, sampled on even `time` (n,) [s].

        `pressures` [Pa] are by the names of the `elements`.
        """
        arrival = engine_torque.arrival + self.torque_shift
        torque = np.interp(time, arrival, engine_torque.values)
        if self.torque_lag > _SHORTEST_LAG:
            torque = apply_lag(torque, float(time[1] - time[0]), self.torque_lag)
        found = {ENGINE_TORQUE: Signal(time, torque)}
        for one in elements:
            given, slope = pressures[one.name], self.slopes.get(one.name)
            late = np.interp(time, given.arrival + self.pressure_delay, given.values)
            found[one.name] = Signal(time, late if slope is None else slope.apply(late, one.P0))
        return found


DIRECT = InputPath()
"""Path of inputs that act as they are commanded."""
