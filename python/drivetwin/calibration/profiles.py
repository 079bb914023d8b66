# SPDX-License-Identifier: MIT
"""Profiles of a shift: engine torque and clutch pressures over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

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


class Policy(Protocol):
    """Controller policy: parameters, and the profiles that follow from their values."""

    @property
    def parameters(self) -> tuple[PolicyParameter, ...]:
        """Parameters in the order of the values."""

    def build_profiles(self, values: FloatArray) -> Profiles:
        """Return the profiles of values (p,) in SI."""


@dataclass(frozen=True, eq=False)
class Space:
    """Free parameters of a policy as coordinates (q,) from 0 to 1 between their bounds."""

    policy: Policy

    @property
    def free(self) -> list[int]:
        """Places of the free parameters."""
        return [k for k, one in enumerate(self.policy.parameters) if one.free]

    @property
    def start(self) -> FloatArray:
        """Coordinates (q,) of the starting values."""
        return self.to_coordinates(np.array([one.start for one in self.policy.parameters]))

    def to_values(self, coordinates: FloatArray) -> FloatArray:
        """Convert coordinates (q,) to values (p,) of all parameters."""
        parameters = self.policy.parameters
        values = np.array([one.start for one in parameters], dtype=np.float64)
        for k, share in zip(self.free, coordinates, strict=True):
            one = parameters[k]
            values[k] = one.low + share * (one.high - one.low)
        return values

    def to_coordinates(self, values: FloatArray) -> FloatArray:
        """Convert values (p,) to coordinates (q,); what lies beyond a bound comes to lie on it."""
        chosen = [(self.policy.parameters[k], values[k]) for k in self.free]
        shares = [(value - one.low) / (one.high - one.low) for one, value in chosen]
        return np.clip(np.array(shares, dtype=np.float64), 0.0, 1.0)

    def build_profiles(self, coordinates: FloatArray) -> Profiles:
        """Return the profiles of coordinates (q,)."""
        return self.policy.build_profiles(self.to_values(coordinates))


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
