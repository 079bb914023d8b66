# SPDX-License-Identifier: MIT
"""Gear shifts: gears, elements, phase boundaries, and the settings of their detection.

Gears held between two shifts of one log are divided in their middle: no sample counts twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, Where
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.shift_kind import ShiftKind


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
    findings: tuple[Finding, ...] = ()

    @property
    def name(self) -> str:
        """Gears, as `2→3`."""
        return f"{self.start_gear}→{self.end_gear}"


@dataclass(frozen=True)
class RejectedShift:
    """A candidate that is no usable shift, and why."""

    time: tuple[float, float]
    reason: str


_WINDOW = 0.3
"""Span before break-away [s] that decides the power state."""


_PEDAL = 0.05
"""Least accelerator position that counts as power on."""


def classify_shift(
    log: ShiftLog, up: bool, break_away: float
) -> tuple[ShiftKind, tuple[Finding, ...]]:
    """Kind of the shift; of unknown power, with a finding, if no channel indicates it.

    Power is on where the mean engine torque in the last 0.3 s before break-away [s] is positive;
    in its absence the output torque's sign or the accelerator (above 5 %) decides.
    """
    power_on: bool | None = None
    limits = {"engine_torque": 0.0, "output_torque": 0.0, "throttle": _PEDAL}
    findings: tuple[Finding, ...] = ()
    for role, limit in limits.items():
        if role in log:
            mean = _compute_mean(log, role, break_away)
            if np.isfinite(mean):
                power_on = mean > limit
                break
    else:
        findings = (report(Code.POWER_STATE_UNKNOWN),)
    return ShiftKind.from_direction(up=up, power_on=power_on), findings


def _compute_mean(log: ShiftLog, role: str, end: float) -> float:
    channel = log[role]
    grid = np.linspace(end - _WINDOW, end, 31)
    values = channel.interpolate(grid)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def make_shift_labels(shifts: Sequence[Shift], to: str = "→") -> list[str]:
    """Labels of the shifts of a log by their gears, `2→3`; repeated ones with the time of lock-up,
    `2→3 at 3.34 s`.
    """
    names = [f"{one.start_gear}{to}{one.end_gear}" for one in shifts]
    return [
        f"{name} at {one.lockup_time:.2f} s" if names.count(name) > 1 else name
        for name, one in zip(names, shifts, strict=True)
    ]


def compute_exclusive_spans(shifts: Sequence[Shift]) -> tuple[tuple[float, float], ...]:
    """The span [s] that each shift of one log accounts for.

    Each then starts in a gear that is surely held, and ends before the next shift's pressures act.
    """
    borders = _compute_borders(shifts)
    starts = [shifts[0].before[0], *borders]
    ends = [*borders, shifts[-1].after[1]]
    return tuple(
        (max(start, one.before[0]), min(end, one.after[1]))
        for start, end, one in zip(starts, ends, shifts, strict=True)
    )


def split_shared_gears(shifts: Sequence[Shift]) -> tuple[Shift, ...]:
    """The shifts of one log with the gears between them divided, so that they share no sample."""
    spans = compute_exclusive_spans(shifts)
    return tuple(
        replace(one, before=(start, one.before[1]), after=(one.after[0], end))
        for one, (start, end) in zip(shifts, spans, strict=True)
    )


def compute_exclusive_masks(
    shifts: Sequence[Shift], times: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.bool_], ...]:
    """Masks (n,) of the samples that are each shift's own.

    `times` (n,) [s] belong to what was made of each shift of one log. Put together, what is left
    of them increases as each of them does.
    """
    borders = _compute_borders(shifts)
    return tuple(
        np.searchsorted(borders, time, side="right") == place for place, time in enumerate(times)
    )


def _compute_borders(shifts: Sequence[Shift]) -> list[float]:
    """Middle of each gear held between two shifts; where what counts of it for the one ends before
    what counts for the other begins, the beginning of the latter."""
    return [
        b.before[0]
        if a.after[1] <= b.before[0]
        else 0.5 * (max(a.after[0], b.before[0]) + b.before[1])
        for a, b in pairwise(shifts)
    ]
