# SPDX-License-Identifier: MIT
"""What a gear shift is: gears, elements, phase boundaries."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum


class ShiftKind(StrEnum):
    """Direction and power state of a shift."""

    POWER_ON_UP = "power-on upshift"
    POWER_OFF_UP = "power-off upshift"
    POWER_ON_DOWN = "power-on downshift"
    POWER_OFF_DOWN = "power-off downshift"


@dataclass(frozen=True)
class Shift:
    """One shift from gear `start_gear` to `end_gear` (names on the card), times in s.

    The four phases of THEORY section 4 are: gear held in `before`, torque phase, inertia phase,
    and `after` (the new gear locked, from `lockup_time` on). `sigma` holds one standard deviation
    of each boundary: keys `torque_start`, `inertia_start`, `lockup`.
    """

    start_gear: str
    end_gear: str
    offgoing: str
    oncoming: str
    kind: ShiftKind
    before: tuple[float, float]
    torque_phase: tuple[float, float]
    inertia_phase: tuple[float, float]
    after: tuple[float, float]
    lockup_time: float
    sigma: dict[str, float] = field(default_factory=dict)
    quality: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class RejectedShift:
    """A candidate that is no usable shift, and why."""

    time: tuple[float, float]
    reason: str
