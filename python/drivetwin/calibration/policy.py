# SPDX-License-Identifier: MIT
"""Policies, and their free parameters as coordinates from 0 to 1."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.closed_loop import Control
from drivetwin.calibration.profiles import PolicyParameter


class Policy(Protocol):
    """Policy: parameters, and the control of a shift that follows from their values."""

    @property
    def parameters(self) -> tuple[PolicyParameter, ...]:
        """Parameters in the order of the values."""

    def build_control(self, values: FloatArray) -> Control:
        """Return the control of values (p,) in SI."""


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
