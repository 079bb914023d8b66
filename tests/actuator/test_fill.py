# SPDX-License-Identifier: MIT
"""Play of the valve and stroke of the piston."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.actuator.fill import Stroke, apply_hysteresis
from drivetwin.actuator.held_signal import HeldSignal

BAR = 1e5


def hold(*corners: tuple[float, float]) -> HeldSignal:
    time, values = zip(*corners, strict=True)
    return HeldSignal(np.array(time), BAR * np.array(values))


def test_rising_and_falling_commands_are_apart_by_the_hysteresis() -> None:
    command = hold((0.0, 0.0), (1.0, 5.0), (2.0, 5.1), (3.0, 5.05), (4.0, 3.0), (5.0, 0.0))
    valve = apply_hysteresis(command, 0.2 * BAR, 0.0)
    assert valve.values / BAR == pytest.approx([0.0, 4.9, 5.0, 5.0, 3.1, 0.0])


@given(st.lists(st.floats(0.0, 20.0), min_size=1, max_size=20), st.floats(0.0, 3.0))
def test_the_valve_stays_within_half_the_hysteresis(levels: list[float], width: float) -> None:
    command = hold(*((0.1 * k, each) for k, each in enumerate(levels)))
    valve = apply_hysteresis(command, width * BAR, float(command.values[0]))
    assert (valve.values >= 0.0).all()
    assert (np.abs(valve.values - command.values) <= 0.5 * width * BAR + 1e-6).all()


def test_the_spring_holds_the_pressure_until_the_clutch_is_full() -> None:
    acting = Stroke(1.0 * BAR, 0.2).limit_pressure(hold((0.0, 0.0), (1.0, 5.0)))
    assert acting.time.tolist() == pytest.approx([0.0, 1.0, 1.0 + 0.2 / 2.0])
    assert acting.values / BAR == pytest.approx([0.0, 1.0, 5.0])


def test_a_clutch_that_was_filled_is_filled_no_more() -> None:
    filled = hold((0.0, 5.0), (1.0, 2.0), (2.0, 6.0))
    acting = Stroke(1.0 * BAR, 0.2).limit_pressure(filled)
    assert acting.values.tolist() == filled.values.tolist()


def test_a_clutch_that_was_partly_emptied_needs_the_rest() -> None:
    # 0.05 s at 1 bar below the spring takes a quarter of the volume away.
    acting = Stroke(1.0 * BAR, 0.2).limit_pressure(hold((0.0, 5.0), (1.0, 0.0), (1.05, 2.0)))
    assert acting.time[-1] == pytest.approx(1.05 + 0.25 * 0.2)
    assert acting.values / BAR == pytest.approx([5.0, 0.0, 1.0, 2.0])


def test_without_a_fill_time_the_valve_acts() -> None:
    valve = hold((0.0, 0.0), (1.0, 5.0))
    assert Stroke(1.0 * BAR, 0.0).limit_pressure(valve) is valve


def test_a_fill_that_does_not_end_stays_at_the_spring() -> None:
    acting = Stroke(1.0 * BAR, 10.0).limit_pressure(hold((0.0, 0.0), (1.0, 3.0), (2.0, 2.0)))
    assert acting.values[:3] / BAR == pytest.approx([0.0, 1.0, 1.0])
    full = 1.0 + (10.0 - np.sqrt(2.0)) / 1.0 + 1.0
    assert acting.time[-1] == pytest.approx(full)


@given(st.integers(1, 40), st.floats(0.05, 0.4), st.floats(1.2, 9.0))
def test_a_clutch_is_full_at_the_same_time_however_often_the_command_is_repeated(
    parts: int, fill_time: float, level: float
) -> None:
    # The last part ends where the clutch becomes full, as far as time resolves it.
    stroke = Stroke(1.0 * BAR, fill_time)
    full = 100.0 + fill_time / np.sqrt(level - 1.0)
    times = [0.0, *np.linspace(100.0, full, parts + 1).tolist()]
    levels = [0.0] + [level + 1e-9 * k for k in range(parts + 1)]
    acting = stroke.limit_pressure(hold(*zip(times, levels, strict=True)))
    late = acting.evaluate(np.array([full + 1e-6, full + 10.0]))
    assert late / BAR == pytest.approx([level, level])
