# SPDX-License-Identifier: MIT
"""Policies, and their free parameters as coordinates from 0 to 1."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Control
from drivetwin.errors import InputError

_AT_BOUND = 0.01
"""Distance from a bound, over the range, within which a parameter is at it: moves of the last
polish stop short of the bound by less."""


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


@dataclass(frozen=True)
class Policy:
    """Policy: parameters, and the control of a shift that follows from their values.

    Raises InputError where a parameter has no room between its bounds or starts outside them.
    """

    parameters: tuple[PolicyParameter, ...]

    def __post_init__(self) -> None:
        for one in self.parameters:
            if not one.low < one.high or not one.low <= one.start <= one.high:
                raise InputError(
                    f"{one.name} starts at {one.start:g} {one.unit} with bounds {one.low:g} to "
                    f"{one.high:g}",
                    "give bounds that increase and contain the start",
                )

    @abstractmethod
    def build_control(self, values: FloatArray) -> Control:
        """Return the control of values (p,) in SI, in the order of the parameters."""

    def set_start(self, values: Mapping[str, float]) -> Self:
        """Return the policy with other starting values by name, moved onto the bounds.

        Raises InputError for an unknown name.
        """
        self._refuse_unknown(values)
        moved = tuple(
            replace(one, start=min(max(values.get(one.name, one.start), one.low), one.high))
            for one in self.parameters
        )
        return replace(self, parameters=moved)

    def set_bounds(self, bounds: Mapping[str, tuple[float, float]]) -> Self:
        """Return the policy with other bounds by name (SI), and starting values moved onto them.

        A parameter with equal bounds keeps that value. Raises InputError for an unknown name.
        """
        self._refuse_unknown(bounds)
        changed = []
        for one in self.parameters:
            low, high = bounds.get(one.name, (one.low, one.high))
            start = min(max(one.start, low), high)
            if low == high:  # its old bounds stay, as those of a parameter that is not free
                low, high = min(one.low, start), max(one.high, start)
                changed.append(replace(one, low=low, high=high, start=start, free=False))
            else:
                changed.append(replace(one, low=low, high=high, start=start))
        return replace(self, parameters=tuple(changed))

    def list_at_bounds(self, values: FloatArray) -> list[tuple[PolicyParameter, float]]:
        """List the free parameters of values (p,) that end at a bound, with that bound."""
        found = []
        for one, value in zip(self.parameters, values.tolist(), strict=True):
            near = _AT_BOUND * (one.high - one.low)
            bounds = [end for end in (one.low, one.high) if abs(value - end) <= near]
            if one.free and bounds:
                found.append((one, bounds[0]))
        return found

    def name_values(self, values: FloatArray) -> dict[str, float]:
        """Return values (p,) by the names of the parameters."""
        names = (one.name for one in self.parameters)
        return dict(zip(names, values.tolist(), strict=True))

    def _refuse_unknown(self, given: Iterable[str]) -> None:
        names = [one.name for one in self.parameters]
        if unknown := [name for name in given if name not in names]:
            raise InputError(
                f"the policy has no parameter {', '.join(unknown)}", f"use {', '.join(names)}"
            )


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

    def build_control(self, coordinates: FloatArray) -> Control:
        """Return the control of coordinates (q,)."""
        return self.policy.build_control(self.to_values(coordinates))
