# SPDX-License-Identifier: MIT
"""Settings of shift detection, checked on construction."""

from __future__ import annotations

from dataclasses import dataclass, fields

from drivetwin.errors import InputError, Where


@dataclass(frozen=True)
class ShiftSettings:
    """Times in s, speeds in rad/s. Every field must be positive; raises InputError otherwise."""

    ratio_tolerance: float = 0.01
    """A gear may be held where |ω_in - i·ω_out| stays below this part of i·ω_out."""
    min_output_speed: float = 5.0
    """Below this output speed the vehicle counts as standing and no ratio is formed."""
    min_hold: float = 0.15
    """Shortest time at one ratio that counts as a gear held."""
    max_dropout: float = 0.05
    """A gear stays held across a disturbance of its ratio up to this long."""
    settle: float = 0.05
    """Left out of `before` after the lock-up of the shift before."""
    min_inertia_samples: int = 4
    """An inertia phase with fewer speed samples has no boundary that can be located."""
    max_inertia_phase: float = 5.0
    """A longer time between two gears is driving in neutral or an open converter, no shift."""
    max_torque_phase: float = 1.0
    """Longest time before break-away searched for the onset of the on-coming element's torque."""
    unknown_torque_phase: float = 0.2
    """Standard deviation of `torque_start` if no channel determines it."""
    hinge_window: float = 0.06
    """Span of moving slip that a boundary is fitted to; up to four times as long where it starts or
    ends gently, and longer where samples are sparse."""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not value > 0.0:
                raise InputError(
                    f"shift setting {item.name} is {value!r}",
                    "give a positive number",
                    Where(key=item.name),
                )
