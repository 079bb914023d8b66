# SPDX-License-Identifier: MIT
"""The exact lag against an integration by SciPy, from change to change of the input."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.lag import Lag, solve_lag

FloatArray = NDArray[np.float64]
BAR = 1e5


def integrate(held: HeldSignal, initial: float, lag: Lag, at: FloatArray) -> FloatArray:
    """Integrate T²·p'' + 2·ζ·T·p' + p = w with steps that end where the input changes."""
    state, parts = np.array([initial, 0.0]), []
    ends = [*held.time.tolist(), float(at[-1]) + 1e-3]
    for (begin, end), value in zip(pairwise(ends), held.values.tolist(), strict=True):

        def slope(_: float, y: FloatArray, held_at: float = value) -> list[float]:
            offset = float(y[0]) - held_at
            T = lag.falling if offset > 0.0 or (offset == 0.0 and y[1] > 0.0) else lag.rising
            return [y[1], -(offset + 2.0 * lag.damping * T * y[1]) / T**2]

        inside = at[(at >= begin) & (at < end)]
        run = solve_ivp(
            slope,
            (begin, end),
            state,
            dense_output=True,
            rtol=1e-10,
            atol=1e-4,
            max_step=2e-3,
        )
        assert run.sol is not None
        parts.append(run.sol(inside)[0])
        state = run.y[:, -1]
    return np.concatenate(parts)


@pytest.mark.parametrize("damping", [0.3, 0.9, 1.0 - 1e-7, 1.0, 1.0 + 1e-4, 1.4, 3.0])
def test_the_solution_is_that_of_an_integration(damping: float) -> None:
    random = np.random.default_rng(3)
    held = HeldSignal(np.arange(0.0, 0.4, 0.02), BAR * random.integers(0, 9, 20).astype(float))
    lag, at = Lag(0.03, 0.05, damping), np.linspace(0.0, 0.6, 601)
    exact = solve_lag(held, 2.0 * BAR, lag).evaluate(at)
    assert np.abs(exact - integrate(held, 2.0 * BAR, lag, at)).max() < 5.0


def test_one_step_is_the_textbook_response() -> None:
    held, at = HeldSignal(np.array([0.0, 0.1]), np.array([0.0, BAR])), np.linspace(0.1, 1.0, 91)
    t = (at - 0.1) / 0.03
    exact = BAR * (1.0 - (1.0 + t) * np.exp(-t))
    response = solve_lag(held, 0.0, Lag(0.03, 0.2, 1.0)).evaluate(at)
    assert response == pytest.approx(exact, abs=1e-6)


def test_falling_has_its_own_time_constant() -> None:
    held = HeldSignal(np.array([0.0, 0.1]), np.array([BAR, 0.0]))
    at = np.array([0.13])
    slow = solve_lag(held, BAR, Lag(0.01, 0.09, 1.0)).evaluate(at)[0]
    fast = solve_lag(held, BAR, Lag(0.09, 0.01, 1.0)).evaluate(at)[0]
    assert slow > 0.9 * BAR
    assert fast < 0.3 * BAR


def test_an_overshoot_falls_with_the_time_constant_of_falling() -> None:
    held, lag = HeldSignal(np.array([0.0, 0.1]), np.array([0.0, BAR])), Lag(0.02, 0.06, 0.4)
    at = np.linspace(0.0, 1.0, 1001)
    response = solve_lag(held, 0.0, lag).evaluate(at)
    assert response.max() > 1.1 * BAR
    assert np.abs(response - integrate(held, 0.0, lag, at)).max() < 5.0


@settings(max_examples=60)
@given(
    st.lists(st.floats(0.0, 20.0), min_size=1, max_size=8),
    st.floats(0.002, 0.3),
    st.floats(0.002, 0.3),
    st.floats(0.2, 3.0),
)
def test_a_finer_hold_of_the_same_input_changes_nothing(
    levels: list[float], rising: float, falling: float, damping: float
) -> None:
    time, lag = np.arange(len(levels), dtype=np.float64) / 20.0, Lag(rising, falling, damping)
    coarse = HeldSignal(time, BAR * np.array(levels))
    fine_time = np.arange(10 * len(levels), dtype=np.float64) / 200.0
    fine = HeldSignal(fine_time, np.repeat(coarse.values, 10))
    at = np.linspace(0.0, 1.0, 97)
    one, other = (solve_lag(each, 0.0, lag).evaluate(at) for each in (coarse, fine))
    assert np.isfinite(one).all()
    assert other == pytest.approx(one, abs=1.0)
