# SPDX-License-Identifier: MIT
"""Profiles of a shift: engine torque and clutch pressures over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal


@dataclass(frozen=True, eq=False)
class Profiles:
    """Engine torque [N m] and pressures [Pa] at the clutches, linear between their corners."""

    engine_torque: Signal
    offgoing: Signal
    oncoming: Signal

    @property
    def signals(self) -> dict[str, Signal]:
        """Signals by name, as files and figures call them."""
        return {
            "engine_torque": self.engine_torque,
            "pressure.offgoing": self.offgoing,
            "pressure.oncoming": self.oncoming,
        }

    def delay_pressures(self, delay: float) -> Profiles:
        """Return the profiles with pressures that act later by `delay` [s]."""
        late = [replace(one, delay=one.delay + delay) for one in (self.offgoing, self.oncoming)]
        return Profiles(self.engine_torque, *late)

    def sample(self, time: FloatArray) -> Profiles:
        """Return the profiles with corners at `time` (n,) [s] alone.

        The core passes samples of one distance with one operator; corners between them need their
        own in every run.
        """
        return Profiles(
            *(
                Signal(time, np.interp(time, one.arrival, one.values))
                for one in (self.engine_torque, self.offgoing, self.oncoming)
            )
        )


@dataclass(frozen=True)
class PolicyParameter:
    """A number of the policy: SI `unit`, bounds, starting value, and its meaning.

    A parameter that is not `free` keeps its starting value.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    text: str
    free: bool = True


def check_parameters(parameters: tuple[PolicyParameter, ...]) -> None:
    """Raise InputError where a parameter has no room between its bounds or starts outside them."""
    for one in parameters:
        if not one.low < one.high or not one.low <= one.start <= one.high:
            raise InputError(
                f"{one.name} starts at {one.start:g} {one.unit} with bounds {one.low:g} to "
                f"{one.high:g}",
                "give bounds that increase and contain the start",
            )


def move_start(
    parameters: tuple[PolicyParameter, ...], values: Mapping[str, float]
) -> tuple[PolicyParameter, ...]:
    """Return parameters with other starting values by name, moved onto the bounds.

    Raises InputError for an unknown name.
    """
    names = [one.name for one in parameters]
    if unknown := [name for name in values if name not in names]:
        raise InputError(
            f"the policy has no parameter {', '.join(unknown)}", f"use {', '.join(names)}"
        )
    return tuple(
        replace(one, start=min(max(values.get(one.name, one.start), one.low), one.high))
        for one in parameters
    )
