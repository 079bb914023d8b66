# SPDX-License-Identifier: MIT
"""Plates of a clutch or brake: friction law, gain, fill pressure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck


@dataclass(frozen=True)
class Plates:
    """Capacity of a clutch: μ(|slip|) · gain · (pressure - p0), static `peak` times that at rest.

    `friction` is a law or a constant μ; gain in m³, p0 in Pa, drum inertia in kg·m². By default
    the pressure itself is the capacity [N·m]. `drag` are the fields of a table of drag torque over
    slip, or none.
    """

    friction: Stribeck | FrictionTable | float = 1.0
    gain: float = 1.0
    p0: float = 0.0
    peak: float = 1.0
    drum_inertia: float = 0.0
    drag: Mapping[str, Any] | None = None

    def describe(self) -> dict[str, Any]:
        """Return the fields of the element."""
        law = self.friction
        friction: Any = (
            asdict(law)
            if isinstance(law, Stribeck | FrictionTable)
            else {"slip": [0.0], "mu": [law]}
        )
        return {
            "friction": friction,
            "gain": self.gain,
            "p0": self.p0,
            "peak": self.peak,
            "drum_inertia": self.drum_inertia,
            **({} if self.drag is None else {"drag": dict(self.drag)}),
        }
