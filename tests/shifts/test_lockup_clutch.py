# SPDX-License-Identifier: MIT
"""Closings of the converter's lock-up clutch, from its flag and from the speeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin import detect_shifts, identify
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import IdentificationError
from drivetwin.shifts.lockup_clutch import (
    detect_lock_ups,
    find_open_spans,
    refer_to_turbine,
)
from drivetwin.simulation.added_elements import Converter
from tests.shifts.fixtures import Plan, make_card
from tests.support.arrays import FloatArray

LETS_GO = 0.3
"""Time around an opening that is left out, s."""
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
    (found,) = detect_lock_ups(log(closing(2.0), (TIME >= 1.999).astype(np.float64)), CARD)
    assert found.time == pytest.approx(2.0, abs=1e-9)
    assert found.sigma == pytest.approx(0.02 / np.sqrt(12.0))
    assert found.warning == ""
    (found,) = detect_lock_ups(log(closing(2.0)), CARD)
    assert abs(found.time - 2.0) < 4.0 * found.sigma, "the speeds tell without a flag"
    assert found.end > 5.9
    for flag in (None, np.ones(TIME.size)):
        assert detect_lock_ups(log(INLET, flag), CARD) == (), "closed throughout is no event"


def test_the_speeds_tell_where_it_is_open() -> None:
    ((start, end),) = find_open_spans(log(closing(2.0)), 1.0)
    assert start == pytest.approx(0.0, abs=0.06)
    assert end == pytest.approx(2.0, abs=0.1)
    assert find_open_spans(log(INLET), 1.0) == ()
    assert find_open_spans(ShiftLog({}, "made", ""), 1.0) == ()


def test_a_late_engine_speed_is_not_open() -> None:
    made = PLAN.log()
    inlet = made["input_speed"]
    late = replace(inlet, role="engine_speed", time=inlet.time + 0.08)
    assert (
        find_open_spans(replace(made, channels={**made.channels, "engine_speed": late}), 1.0) == ()
    )


def test_a_shift_with_an_open_converter_is_refused() -> None:
    made = PLAN.log()
    found = detect_shifts(made, PLAN.card())
    inlet = made["input_speed"]
    engine = replace(inlet, role="engine_speed", values=1.05 * inlet.values)
    whole = replace(made, channels={**made.channels, "engine_speed": engine})
    with pytest.raises(IdentificationError, match=r"converter is open.*5\.0 %"):
        identify(whole, PLAN.card(), found)


def test_with_a_map_the_turbine_stands_for_the_engine() -> None:
    converter = Converter((0.0, 1.0), (0.05, 0.0), (2.0, 1.0))
    card = replace(PLAN.card(), converter=converter)
    (shift,), _ = detect_shifts(PLAN.log(), card)
    made = PLAN.log()
    inlet = made["input_speed"]
    for factor in (1.25, 1.0):
        engine = replace(inlet, role="engine_speed", values=factor * inlet.values)
        whole = replace(made, channels={**made.channels, "engine_speed": engine})
        found = refer_to_turbine(whole, card, shift)
        if factor == 1.0:
            assert found is whole
            continue
        assert "engine_speed" not in found
        # ν = 0.8: C = 0.01, m = 1.2.
        expected = 1.2 * 0.01 * engine.values**2
        assert found["engine_torque"].values == pytest.approx(expected)
        assert refer_to_turbine(found, card, shift) is found


def test_the_turbine_torque_is_told_from_fresh_speeds() -> None:
    """A speed that the logger repeats is old until the next: the torque would be of another one."""
    converter = Converter((0.0, 1.0), (0.05, 0.0), (2.0, 1.0))
    card = replace(PLAN.card(), converter=converter)
    made = PLAN.log()
    inlet = made["input_speed"]
    engine = replace(inlet, role="engine_speed", values=1.25 * inlet.values)
    exact = replace(made, channels={**made.channels, "engine_speed": engine})
    (shift,), _ = detect_shifts(exact, card)
    stale = np.arange(inlet.time.size) // 20 * 20
    held = {one.role: replace(one, values=one.values[stale], held=True) for one in (engine, inlet)}
    found = refer_to_turbine(replace(made, channels={**made.channels, **held}), card, shift)
    torque = found["engine_torque"]
    expected = refer_to_turbine(exact, card, shift)["engine_torque"].interpolate(torque.time)
    assert torque.time.size < inlet.time.size / 10
    assert torque.values == pytest.approx(expected, rel=1e-9)


CONVERTER = Converter((0.0, 1.0), (0.05, 0.0), (2.0, 1.0))


def behind(slip: FloatArray, flag: FloatArray | None = None) -> ShiftLog:
    """A shift at 1.5 s as it is seen behind a converter with `slip` (n,) of its input speed."""
    made = PLAN.log()
    inlet = made["input_speed"]
    engine = replace(inlet, role="engine_speed", values=(1.0 + slip) * inlet.values)
    channels = {**made.channels, "engine_speed": engine}
    if flag is not None:
        channels["lockup_engaged"] = replace(
            inlet, role="lockup_engaged", quantity=Quantity.STATE, values=flag
        )
    card = replace(PLAN.card(), converter=CONVERTER)
    whole = replace(made, channels=channels)
    (shift,), _ = detect_shifts(whole, card)
    return refer_to_turbine(whole, card, shift)


def test_where_the_lock_up_clutch_closes_the_map_tells_nothing() -> None:
    time = PLAN.log()["input_speed"].time
    closes = time[-1] - 0.8
    slip = np.clip(1.5 * (closes - time), 0.0, 0.25)
    by_speeds = behind(slip)["engine_torque"].time
    assert by_speeds[-1] == pytest.approx(closes - LETS_GO, abs=0.1)
    flagged = behind(np.full(time.size, 0.25), (time > closes).astype(np.float64))
    assert flagged["engine_torque"].time[-1] == pytest.approx(closes - LETS_GO, abs=0.01)
    # The speeds may be the same for a while with the clutch open: its flag knows.
    assert behind(slip, np.zeros(time.size))["engine_torque"].time[-1] == pytest.approx(time[-1])


def test_a_map_that_ends_short_of_the_shift_is_refused() -> None:
    time = PLAN.log()["input_speed"].time
    with pytest.raises(IdentificationError, match=r"from 0 to 1; in the shift 2-3 it is 1\.250"):
        behind(np.full(time.size, -0.2))
    # Beyond the shift the torque is merely unknown.
    late = behind(np.where(time > time[-1] - 0.5, -0.2, 0.25))["engine_torque"].time
    assert late[-1] == pytest.approx(time[-1] - 0.5, abs=0.01)
