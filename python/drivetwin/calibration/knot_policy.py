# SPDX-License-Identifier: MIT
"""Policy of free knots: the corners of each profile are the parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.profiles import PolicyParameter, Profiles, check_parameters
from drivetwin.simulation.dual_clutch import Signal

Corners = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class KnotProfile:
    """One profile: free knots at `times` [s] between fixed corners (time [s], value SI).

    `start` are the starting values of the knots, `low` and `high` their common bounds.
    """

    head: Corners
    times: tuple[float, ...]
    tail: Corners
    start: tuple[float, ...]
    low: float
    high: float

    def build_signal(self, values: FloatArray) -> Signal:
        """Return the signal through fixed corners and knots with `values` (k,)."""
        time = [*(t for t, _ in self.head), *self.times, *(t for t, _ in self.tail)]
        fixed = [v for _, v in self.head], [v for _, v in self.tail]
        return Signal(np.array(time), np.array([*fixed[0], *values.tolist(), *fixed[1]]))

    def list_parameters(self, name: str, unit: str) -> tuple[PolicyParameter, ...]:
        """Return the knots as parameters of the policy."""
        return tuple(
            PolicyParameter(
                f"{name}_{number}", unit, self.low, self.high, value, f"value at {time:g} s"
            )
            for number, (time, value) in enumerate(
                zip(self.times, self.start, strict=True), start=1
            )
        )


@dataclass(frozen=True)
class KnotPolicy:
    """Knots of on-coming pressure, off-going pressure [Pa] and engine torque [N m]."""

    oncoming: KnotProfile
    offgoing: KnotProfile
    engine_torque: KnotProfile

    def __post_init__(self) -> None:
        check_parameters(self.parameters)

    @property
    def parameters(self) -> tuple[PolicyParameter, ...]:
        """Knots in the order of on-coming, off-going and engine torque."""
        return (
            *self.oncoming.list_parameters("oncoming_pressure", "Pa"),
            *self.offgoing.list_parameters("offgoing_pressure", "Pa"),
            *self.engine_torque.list_parameters("engine_torque", "N*m"),
        )

    def build_profiles(self, values: FloatArray) -> Profiles:
        """Return the profiles of values (p,) in SI."""
        first = len(self.oncoming.times)
        second = first + len(self.offgoing.times)
        return Profiles(
            engine_torque=self.engine_torque.build_signal(values[second:]),
            offgoing=self.offgoing.build_signal(values[first:second]),
            oncoming=self.oncoming.build_signal(values[:first]),
        )
