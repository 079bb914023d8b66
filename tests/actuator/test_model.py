# SPDX-License-Identifier: MIT
"""Actuator model: bounds, parts in their order, and the lag against an integration by SciPy."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.errors import InputError
from tests.support.arrays import FloatArray

BAR = 1e5
QUICK = ActuatorModel(0.0, 1e-3, 1e-3)
"""Actuator that is on its valve after 20 ms."""
FILLING = replace(QUICK, kiss_pressure=1.0 * BAR, fill_time=0.2)
MODEL = ActuatorModel(0.03, 0.02, 0.03, 1.0, 1.0 * BAR, 0.15, 0.2 * BAR)
STEP = HeldSignal(np.array([0.0, 0.1]), np.array([0.0, 5.0 * BAR]))
LEVELS = st.lists(st.floats(0.0, 20.0), min_size=1, max_size=8)


def hold(*corners: tuple[float, float]) -> HeldSignal:
    """Return a command from times [s] and pressures [bar]."""
    time, values = zip(*corners, strict=True)
    return HeldSignal(np.array(time), BAR * np.array(values))


def integrate(model: ActuatorModel, held: HeldSignal, initial: float, at: FloatArray) -> FloatArray:
    """Integrate T²·p'' + 2·ζ·T·p' + p = w with steps that end where the input w changes."""
    state, parts = np.array([initial, 0.0]), []
    ends = [*held.time.tolist(), float(at[-1]) + 1e-3]
    for (begin, end), value in zip(pairwise(ends), held.values.tolist(), strict=True):

        def slope(_: float, y: FloatArray, held_at: float = value) -> list[float]:
            offset = float(y[0]) - held_at
            falls = offset > 0.0 or (offset == 0.0 and y[1] > 0.0)
            T = model.falling_lag if falls else model.rising_lag
            return [y[1], -(offset + 2.0 * model.damping * T * y[1]) / T**2]

        inside = at[(at >= begin) & (at < end)]
        run = solve_ivp(
            slope, (begin, end), state, dense_output=True, rtol=1e-10, atol=1e-4, max_step=2e-3
        )
        assert run.sol is not None
        parts.append(run.sol(inside)[0])
        state = run.y[:, -1]
    return np.concatenate(parts)


@pytest.mark.parametrize("damping", [0.3, 1.0 - 1e-7, 1.0, 3.0])
def test_the_lag_is_that_of_an_integration(damping: float) -> None:
    random = np.random.default_rng(3)
    held = HeldSignal(np.arange(0.0, 0.4, 0.02), BAR * random.integers(0, 9, 20).astype(float))
    model, at = ActuatorModel(0.0, 0.03, 0.05, damping), np.linspace(0.0, 0.6, 601)
    exact = model.compute_pressure(held, at)
    assert np.abs(exact - integrate(model, held, float(held.values[0]), at)).max() < 5.0


def test_one_step_is_the_textbook_response() -> None:
    at = np.linspace(0.1, 1.0, 91)
    t = (at - 0.1) / 0.03
    exact = BAR * (1.0 - (1.0 + t) * np.exp(-t))
    response = ActuatorModel(0.0, 0.03, 0.2).compute_pressure(hold((0.0, 0.0), (0.1, 1.0)), at)
    assert response == pytest.approx(exact, abs=1e-6)


def test_an_overshoot_falls_with_the_time_constant_of_falling() -> None:
    held, model = hold((0.0, 0.0), (0.1, 1.0)), ActuatorModel(0.0, 0.02, 0.06, 0.4)
    at = np.linspace(0.0, 1.0, 1001)
    response = model.compute_pressure(held, at)
    assert response.max() > 1.1 * BAR
    assert np.abs(response - integrate(model, held, 0.0, at)).max() < 5.0


@given(
    LEVELS, st.floats(0.002, 0.3), st.floats(0.002, 0.3), st.floats(0.2, 3.0), st.floats(0.0, 0.3)
)
def test_a_finer_hold_or_finer_samples_of_the_same_input_change_nothing(
    levels: list[float], rising: float, falling: float, damping: float, fill: float
) -> None:
    model = ActuatorModel(0.013, rising, falling, damping, 1.0 * BAR, fill, 0.2 * BAR)
    time = np.arange(len(levels), dtype=np.float64) / 20.0
    coarse = HeldSignal(time, BAR * np.array(levels))
    fine_time = np.arange(10 * len(levels), dtype=np.float64) / 200.0
    fine = HeldSignal(fine_time, np.repeat(coarse.values, 10))
    at = np.linspace(0.0, 1.0, 97)
    one, other = (model.compute_pressure(each, at) for each in (coarse, fine))
    assert np.isfinite(one).all()
    assert other == pytest.approx(one, abs=1.0)
    finer = model.compute_pressure(coarse, np.linspace(0.0, 1.0, 97 * 7 - 6))
    assert finer[::7] == pytest.approx(one, abs=1.0)


def test_rising_and_falling_commands_are_apart_by_the_hysteresis() -> None:
    command = hold((0.0, 0.0), (1.0, 5.0), (2.0, 5.1), (3.0, 5.05), (4.0, 3.0), (5.0, 0.0))
    model = replace(QUICK, hysteresis=0.2 * BAR)
    settled = model.compute_pressure(command, command.time + 0.9)
    assert settled / BAR == pytest.approx([0.0, 4.9, 5.0, 5.0, 3.1, 0.0], abs=1e-9)


@given(LEVELS, st.floats(0.0, 3.0))
def test_the_valve_stays_within_half_the_hysteresis(levels: list[float], width: float) -> None:
    command = hold(*((0.1 * k, each) for k, each in enumerate(levels)))
    model = replace(QUICK, hysteresis=width * BAR)
    settled = model.compute_pressure(command, command.time + 0.09)
    assert (settled >= -1e-3).all()
    assert (np.abs(settled - command.values) <= 0.5 * width * BAR + 1e-3).all()


@pytest.mark.parametrize(
    ("command", "full"),
    [
        (hold((0.0, 0.0), (1.0, 5.0)), 1.0 + 0.2 / 2.0),
        # 0.05 s at 1 bar below the spring takes a quarter of the volume away.
        (hold((0.0, 5.0), (1.0, 0.0), (1.05, 2.0)), 1.05 + 0.25 * 0.2),
        # 0.01 s at 1 bar above it fills a twentieth.
        (hold((0.0, 0.0), (1.0, 2.0), (1.01, 5.0)), 1.01 + 0.95 * 0.1),
    ],
)
def test_the_spring_holds_the_pressure_until_the_clutch_is_full(
    command: HeldSignal, full: float
) -> None:
    at = np.array([full - 1e-6, full + 1e-6, full + 0.05])
    before, begun, after = FILLING.compute_pressure(command, at) / BAR
    assert before == pytest.approx(1.0, abs=1e-6)
    assert begun > before
    assert after == pytest.approx(command.values[-1] / BAR, abs=1e-6)


def test_a_clutch_that_was_filled_is_filled_no_more() -> None:
    filled = hold((0.0, 5.0), (1.0, 2.0), (2.0, 6.0))
    at = np.linspace(0.0, 3.0, 301)
    without = QUICK.compute_pressure(filled, at)
    assert FILLING.compute_pressure(filled, at) == pytest.approx(without, abs=1e-6)


@given(st.integers(1, 40), st.floats(0.05, 0.4), st.floats(1.2, 9.0))
def test_a_clutch_is_full_at_the_same_time_however_often_the_command_is_repeated(
    parts: int, fill_time: float, level: float
) -> None:
    # The last part ends where the clutch becomes full, as far as time resolves it.
    full = 100.0 + fill_time / np.sqrt(level - 1.0)
    times = [0.0, *np.linspace(100.0, full, parts + 1).tolist()]
    levels = [0.0] + [level + 1e-9 * k for k in range(parts + 1)]
    model = replace(FILLING, fill_time=fill_time)
    late = model.compute_pressure(hold(*zip(times, levels, strict=True)), np.array([full + 0.1]))
    assert late / BAR == pytest.approx([level])


def test_the_pressure_waits_at_the_kiss_pressure_and_ends_below_the_command() -> None:
    full = 0.13 + 0.15 / np.sqrt(4.9 - 1.0)
    pressure = MODEL.compute_pressure(STEP, np.array([full - 1e-4, 2.0]))
    assert pressure[0] == pytest.approx(1.0 * BAR, rel=0.15)
    assert pressure[1] == pytest.approx(4.9 * BAR, rel=1e-6)


def test_the_initial_pressure_counts_as_far_as_the_hysteresis_allows_it() -> None:
    held = HeldSignal(np.array([0.0]), np.array([5.0 * BAR]))
    at = np.array([0.0, 1.0])
    for initial, expected in ((4.95, 4.95), (4.0, 4.9), (9.0, 5.1), (None, 5.0)):
        given = None if initial is None else initial * BAR
        pressure = MODEL.compute_pressure(held, at, given)
        assert pressure / BAR == pytest.approx([expected, expected])


@pytest.mark.parametrize("name", QUANTITIES)
def test_values_outside_their_bounds_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=QUANTITIES[name].label):
        replace(MODEL, **{name: QUANTITIES[name].upper * 1.01})
    with pytest.raises(InputError, match=QUANTITIES[name].label):
        replace(MODEL, **{name: QUANTITIES[name].lower - 0.01})


def test_a_value_holds_to_the_next_and_before_the_first() -> None:
    held = HeldSignal(np.array([1.0, 2.0, 3.0]), np.array([5.0, 5.0, 7.0]))
    assert held.evaluate(np.array([0.0, 1.0, 2.99, 3.0, 9.0])).tolist() == [5, 5, 5, 7, 7]
    changes = held.drop_repeated()
    assert changes.time.tolist() == [1.0, 3.0]
    assert changes.evaluate(np.array([2.5, 3.5])).tolist() == [5, 7]


@pytest.mark.parametrize(
    ("time", "values", "says"),
    [
        ([], [], "0 times"),
        ([0.0, 1.0], [1.0], "2 times and 1 values"),
        ([0.0, 0.0], [1.0, 2.0], "do not increase"),
        ([0.0, 1.0], [1.0, np.nan], "not finite"),
    ],
)
def test_other_signals_are_refused(time: list[float], values: list[float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        HeldSignal(np.array(time), np.array(values))
