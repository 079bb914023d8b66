# SPDX-License-Identifier: MIT
"""Summary of a drive: groups, spread, worst; findings and rejections counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.shifts.shift import Shift
from drivetwin.shifts.summary import (
    compare_drives,
    summarize_shifts,
)
from drivetwin.vehicle.spec import ShiftKind

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
    assert pair.median == pytest.approx(0.5)
    assert pair.low == pytest.approx(0.42)
    assert pair.high == pytest.approx(0.58)
    assert (pair.worst, pair.worst_time) == (0.6, 3.0)
    assert groups[0].figures["shift_time"].worst_time == 2.0
    assert groups[2].figures["shift_time"].trend is None


def _make_drive(seed: int, count: int, mean: float, growth: float = 0.0) -> list[Shift]:
    generator = np.random.default_rng(seed)
    return [
        _make(2, 60.0 * k, float(mean * np.exp(0.1 * generator.standard_normal()) + growth * k))
        for k in range(count)
    ]


def test_outlier_and_trend_of_alike_shifts_are_given() -> None:
    shifts = _make_drive(7, 30, 0.5)
    (group,) = summarize_shifts(shifts)
    clean = group.figures["shift_time"]
    assert clean.outliers == ()
    assert clean.trend is not None
    assert clean.trend.p > 0.05
    slow = replace(shifts[7], quality={"shift_time": 1.2})
    (group,) = summarize_shifts([*shifts[:7], slow, *shifts[8:]])
    (outlier,) = group.figures["shift_time"].outliers
    assert (outlier.time, outlier.value) == (slow.lockup_time, 1.2)
    (group,) = summarize_shifts(_make_drive(7, 30, 0.5, growth=0.01))
    trend = group.figures["shift_time"].trend
    assert trend is not None
    assert trend.p < 0.01
    assert trend.interval[0] < 0.01 / 60.0 < trend.interval[1]


def test_two_software_states_are_compared_by_kind_and_gears() -> None:
    first, slower = _make_drive(2, 20, 0.5), _make_drive(3, 20, 0.6)
    other = [_make(3, 1.0, 0.7)]
    (found,) = compare_drives([*first, *other], slower)
    assert (found.gears, found.figure, found.counts) == ("2→3", "shift_time", (20, 20))
    assert found.differs
    assert found.difference is not None
    assert found.difference.interval[0] < 0.1 < found.difference.interval[1]
    (same,) = compare_drives(first, _make_drive(4, 20, 0.5))
    assert same.differs is False
    (few,) = compare_drives(first, slower[:2])
    assert few.differs is None
    assert compare_drives(first, other) == ()
