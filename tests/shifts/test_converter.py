# SPDX-License-Identifier: MIT
"""Closings of the converter's lock-up clutch, from its flag and from the speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.converter import Converter
from drivetwin.errors import IdentificationError
from drivetwin.logs.shiftlog import Channel, FloatArray, Quantity, ShiftLog
from drivetwin.shifts.converter import (
    behind_converter,
    converter_slip,
    lock_ups,
    open_spans,
    require_closed,
)
from drivetwin.shifts.find import find_shifts
from tests.shifts.made import Plan, make_card

TIME = np.arange(0.0, 6.0, 0.02)
INLET = 120.0 + 5.0 * TIME
PLAN = Plan(gears=(("2", 1.91), ("3", 1.43)), break_aways=(1.5,))
CARD = make_card({"2": 1.91, "3": 1.43})


def log(engine: FloatArray, flag: FloatArray | None = None) -> ShiftLog:
    channels = {
        "engine_speed": Channel("engine_speed", Quantity.SPEED, TIME, engine, "n_e", "rad/s"),
        "input_speed": Channel("input_speed", Quantity.SPEED, TIME, INLET, "n_t", "rad/s"),
    }
    if flag is not None:
        channels["lockup_engaged"] = Channel(
            "lockup_engaged", Quantity.STATE, TIME, flag, "luc", ""
        )
    return ShiftLog(channels, "made", "")


def closing(at: float) -> FloatArray:
    """12 % slip that comes to rest within 0.2 s before `at`."""
    return INLET * (1.0 + 0.12 * np.clip((at - TIME) / 0.2, 0.0, 1.0))


def test_the_flag_tells_when_and_the_speeds_agree() -> None:
    (found,) = lock_ups(log(closing(2.0), (TIME >= 1.999).astype(np.float64)), CARD)
    assert found.time == pytest.approx(2.0, abs=1e-9)
    assert found.sigma == pytest.approx(0.02 / np.sqrt(12.0))
    assert found.warning == ""


def test_a_flag_that_lies_is_told() -> None:
    (found,) = lock_ups(log(closing(9.0), (TIME > 2.0).astype(np.float64)), CARD)
    assert "differ by 12.0 %" in found.warning


def test_without_a_flag_the_speeds_tell() -> None:
    (found,) = lock_ups(log(closing(2.0)), CARD)
    assert abs(found.time - 2.0) < 4.0 * found.sigma
    assert found.end > 5.9


def test_a_late_engine_speed_is_no_opening() -> None:
    made = PLAN.log()
    inlet = made["input_speed"]
    late = replace(inlet, role="engine_speed", time=inlet.time + 0.03)
    assert lock_ups(replace(made, channels={**made.channels, "engine_speed": late}), CARD) == ()


def test_the_speeds_tell_where_it_is_open() -> None:
    ((start, end),) = open_spans(log(closing(2.0)), 1.0)
    assert start == pytest.approx(0.0, abs=0.06)
    assert end == pytest.approx(2.0, abs=0.1)
    assert open_spans(log(INLET), 1.0) == ()
    assert open_spans(ShiftLog({}, "made", ""), 1.0) == ()


def test_a_late_engine_speed_is_not_open() -> None:
    made = PLAN.log()
    inlet = made["input_speed"]
    late = replace(inlet, role="engine_speed", time=inlet.time + 0.08)
    assert open_spans(replace(made, channels={**made.channels, "engine_speed": late}), 1.0) == ()


def test_closed_throughout_is_no_event() -> None:
    assert lock_ups(log(INLET), CARD) == ()
    assert lock_ups(log(INLET, np.ones(TIME.size)), CARD) == ()


def test_mean_slip() -> None:
    assert converter_slip(log(1.05 * INLET), CARD, (1.0, 3.0)) == pytest.approx(0.05)
    assert converter_slip(ShiftLog({}, "made", ""), CARD, (1.0, 3.0)) is None


def test_a_shift_with_an_open_converter_is_refused() -> None:
    (shift,), _ = find_shifts(PLAN.log(), PLAN.card())
    made = PLAN.log()
    inlet = made["input_speed"]
    for factor, refused in ((1.0, False), (1.05, True)):
        engine = replace(inlet, role="engine_speed", values=factor * inlet.values)
        whole = replace(made, channels={**made.channels, "engine_speed": engine})
        if refused:
            with pytest.raises(IdentificationError, match=r"converter is open.*5\.0 %"):
                require_closed(whole, PLAN.card(), shift)
        else:
            require_closed(whole, PLAN.card(), shift)


def test_with_a_map_the_turbine_stands_for_the_engine() -> None:
    converter = Converter((0.0, 1.0), (0.05, 0.0), (2.0, 1.0))
    card = replace(PLAN.card(), converter=converter)
    (shift,), _ = find_shifts(PLAN.log(), card)
    made = PLAN.log()
    inlet = made["input_speed"]
    for factor in (1.25, 1.0):
        engine = replace(inlet, role="engine_speed", values=factor * inlet.values)
        whole = replace(made, channels={**made.channels, "engine_speed": engine})
        require_closed(whole, card, shift)
        found = behind_converter(whole, card, shift)
        if factor == 1.0:
            assert found is whole
            continue
        assert "engine_speed" not in found
        # ν = 0.8: C = 0.01, m = 1.2.
        expected = 1.2 * 0.01 * engine.values**2
        assert found["engine_torque"].values == pytest.approx(expected)
        assert behind_converter(found, card, shift) is found
