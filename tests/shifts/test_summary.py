# SPDX-License-Identifier: MIT
"""Summary of a drive: groups, spread, worst; findings and rejections counted."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.findings import Code, report
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.shifts.summary import collect_findings, collect_rejected, summarize_shifts
from drivetwin.vehicle.shift_kind import ShiftKind

_SHIFT = Shift(
    start_gear="2",
    end_gear="3",
    offgoing="B2",
    oncoming="B3",
    kind=ShiftKind.POWER_ON_UP,
    before=(0.0, 1.0),
    torque_phase=(1.0, 1.2),
    inertia_phase=(1.2, 1.5),
    after=(1.5, 3.0),
    lockup_time=1.5,
    quality={"shift_time": 0.5},
)


def _make(gear: int, at: float, duration: float, kind: ShiftKind = _SHIFT.kind) -> Shift:
    return replace(
        _SHIFT,
        start_gear=str(gear),
        end_gear=str(gear + 1),
        kind=kind,
        lockup_time=at,
        quality={"shift_time": duration},
    )


def test_groups_by_kind_then_gears_with_spread_and_worst() -> None:
    shifts = [_make(2, 1.0, 0.4), _make(3, 2.0, 0.9), _make(2, 3.0, 0.6)]
    shifts.append(_make(2, 4.0, 0.5, ShiftKind.POWER_OFF_UP))
    groups = summarize_shifts(shifts)
    assert [(one.kind, one.gears, one.count) for one in groups] == [
        (ShiftKind.POWER_ON_UP, None, 3),
        (ShiftKind.POWER_ON_UP, "2→3", 2),
        (ShiftKind.POWER_ON_UP, "3→4", 1),
        (ShiftKind.POWER_OFF_UP, "2→3", 1),
    ]
    pair = groups[1].figures["shift_time"]
    assert pair.mean == pytest.approx(0.5)
    assert pair.spread == pytest.approx(0.2 / 2.0**0.5)
    assert (pair.worst, pair.worst_time) == (0.6, 3.0)
    assert groups[0].figures["shift_time"].worst_time == 2.0
    assert groups[2].figures["shift_time"].spread is None


def test_a_figure_that_some_shifts_lack_is_of_the_others() -> None:
    (group,) = summarize_shifts([_make(2, 1.0, 0.4), replace(_make(2, 2.0, 0.5), quality={})])
    assert (group.count, group.figures["shift_time"].count) == (2, 1)
    assert summarize_shifts([]) == ()


def test_findings_are_counted_once_for_each_kind_and_gear() -> None:
    unknown = report(Code.POWER_STATE_UNKNOWN)
    third, fourth = (
        report(Code.RATIO_DEVIATES, gear=gear, ratio=1.0, card=1.1) for gear in ("3", "4")
    )
    shifts = [
        replace(_make(2, 1.0, 0.4), findings=(unknown, third)),
        replace(_make(3, 2.0, 0.4), findings=(unknown, third, fourth)),
    ]
    found = [(one.code, one.names.get("gear"), labels) for one, labels in collect_findings(shifts)]
    assert found == [
        (Code.POWER_STATE_UNKNOWN, None, ("2→3", "3→4")),
        (Code.RATIO_DEVIATES, "3", ("2→3", "3→4")),
        (Code.RATIO_DEVIATES, "4", ("3→4",)),
    ]


def test_rejections_are_counted_by_reason() -> None:
    rejected = [RejectedShift((t, t + 1.0), why) for t, why in ((0.0, "a"), (2.0, "b"), (4.0, "a"))]
    assert collect_rejected(rejected) == ((rejected[0], 2), (rejected[1], 1))
