# SPDX-License-Identifier: MIT
"""Flags and gear of the bus: used where nothing else tells, and checked against the speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.findings import render
from drivetwin.shifts.detect import detect_shifts
from tests.shifts.fixtures import Plan
from tests.support.arrays import FloatArray

PLAN = Plan(gears=(("2", 1.91), ("3", 1.43)), break_aways=(1.5,))
TIME = np.arange(0.0, 4.0, 0.01)


def states(**values: FloatArray) -> dict[str, Channel]:
    return {
        role: Channel(role, Quantity.STATE, TIME, column, role, "")
        for role, column in values.items()
    }


def flag(*spans: tuple[float, float]) -> FloatArray:
    return np.array([float(any(low <= t <= high for low, high in spans)) for t in TIME])


def with_states(log: ShiftLog, **values: FloatArray) -> ShiftLog:
    return replace(log, channels={**log.channels, **states(**values)})


def test_agreeing_flags_add_nothing() -> None:
    log = with_states(
        PLAN.log(), shift_in_process=flag((1.1, 2.1)), gear=np.where(TIME < 2.0, 2.0, 3.0)
    )
    found = detect_shifts(log, PLAN.card())
    assert found.rejected == ()
    assert found.shifts[0].findings == ()


def test_contradictions_are_told() -> None:
    log = with_states(
        PLAN.log(), shift_in_process=flag((2.9, 3.4)), gear=np.where(TIME < 2.0, 4.0, 3.0)
    )
    (shift,), (empty,) = detect_shifts(log, PLAN.card())
    assert "Shift flag is not set during this shift." in render(shift.findings)
    assert any("Gear signal is 4" in text and "gear 2" in text for text in render(shift.findings))
    assert empty.time == pytest.approx((2.9, 3.4))
    assert "no change of gear" in empty.reason


def test_the_flag_bounds_a_torque_phase_that_nothing_else_tells() -> None:
    log = PLAN.log()
    bare = {r: c for r, c in log.channels.items() if not r.startswith(("pressure", "output_t"))}
    log = with_states(replace(log, channels=bare), shift_in_process=flag((1.0, 2.1)))
    (shift,), _ = detect_shifts(log, PLAN.card())
    onset, sigma = shift.torque_phase[0], shift.sigma["torque_start"]
    assert onset == pytest.approx(1.25, abs=0.01)
    assert abs(onset - (1.5 - PLAN.torque_phase)) < 2.0 * sigma
    assert "shift flag at 1.000 s" in render(shift.findings)[-1]


def test_a_flag_where_a_speed_is_missing_says_which() -> None:
    log = with_states(PLAN.log(), shift_in_process=flag((1.1, 2.1), (2.9, 3.4)))
    outlet = log["output_speed"]
    keep = outlet.time < 2.5
    dead = replace(outlet, time=outlet.time[keep], values=outlet.values[keep])
    _, (empty,) = detect_shifts(
        replace(log, channels={**log.channels, "output_speed": dead}), PLAN.card()
    )
    assert f"{outlet.source_name!r} has no samples" in empty.reason
