# SPDX-License-Identifier: MIT
"""Summary of the shifts of a drive, by kind and by pair of gears."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.findings import Code, Finding
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.shift_kind import ShiftKind

SUMMARIZED = (
    "shift_time",
    "inertia_phase_time",
    "response_time",
    "wheel_jerk_max",
    "wheel_jerk_of_speed_max",
    "vibration_dose",
)
"""Figures of `QUALITY_UNITS` that are summarised; the largest is the worst."""


@dataclass(frozen=True)
class FigureSummary:
    """One figure of `count` shifts in its SI unit, with the lock-up time [s] of the worst.

    `spread` is the standard deviation between the shifts; None for one shift.
    """

    count: int
    mean: float
    spread: float | None
    worst: float
    worst_time: float


@dataclass(frozen=True)
class ShiftGroup:
    """`count` shifts of one kind, in one pair of `gears` (`2→3`) or, if None, in all of them."""

    kind: ShiftKind
    gears: str | None
    count: int
    figures: dict[str, FigureSummary]


def summarize_shifts(shifts: Sequence[Shift]) -> tuple[ShiftGroup, ...]:
    """Group shifts by kind, each followed by its pairs of gears where there are several."""
    groups = []
    for kind in ShiftKind:
        alike = [one for one in shifts if one.kind is kind]
        pairs: dict[str, list[Shift]] = {}
        for one in alike:
            pairs.setdefault(f"{one.start_gear}→{one.end_gear}", []).append(one)
        if len(pairs) > 1:
            groups.append(_summarize_group(kind, None, alike))
        groups += [_summarize_group(kind, gears, pairs[gears]) for gears in sorted(pairs)]
    return tuple(groups)


def _summarize_group(kind: ShiftKind, gears: str | None, shifts: Sequence[Shift]) -> ShiftGroup:
    figures = {}
    for name in SUMMARIZED:
        found = [(one.quality[name], one.lockup_time) for one in shifts if name in one.quality]
        if not found:
            continue
        values = np.array([value for value, _ in found])
        worst, when = max(found)
        spread = float(values.std(ddof=1)) if len(found) > 1 else None
        figures[name] = FigureSummary(len(found), float(values.mean()), spread, worst, when)
    return ShiftGroup(kind, gears, len(shifts), figures)


def collect_findings(shifts: Iterable[Shift]) -> tuple[tuple[Finding, tuple[str, ...]], ...]:
    """Return the first finding of each kind with the labels of all shifts that have it.

    Findings on different gears are of different kinds.
    """
    first: dict[tuple[Code, str], Finding] = {}
    labels: dict[tuple[Code, str], list[str]] = {}
    for shift in shifts:
        own = {(one.code, one.names.get("gear", "")): one for one in shift.findings}
        for key, one in own.items():
            first.setdefault(key, one)
            labels.setdefault(key, []).append(f"{shift.start_gear}→{shift.end_gear}")
    return tuple((first[key], tuple(labels[key])) for key in first)


def collect_rejected(
    rejected: Iterable[RejectedShift],
) -> tuple[tuple[RejectedShift, int], ...]:
    """Return the first rejected candidate of each reason with their number."""
    first: dict[str, RejectedShift] = {}
    count: dict[str, int] = {}
    for one in rejected:
        first.setdefault(one.reason, one)
        count[one.reason] = count.get(one.reason, 0) + 1
    return tuple((first[reason], count[reason]) for reason in first)
