# SPDX-License-Identifier: MIT
"""Acting inputs against closed forms."""

from __future__ import annotations

import numpy as np

from drivetwin.dyno.departed_run import delay_input, lag_input
from drivetwin.simulation.dual_clutch import Signal

TIME = np.linspace(0.0, 1.0, 1001)


def test_a_lagged_ramp_follows_by_the_time_constant() -> None:
    lagged = lag_input(Signal(TIME, 100.0 * TIME), 0.05)
    exact = 100.0 * (TIME - 0.05 * (1.0 - np.exp(-TIME / 0.05)))
    assert np.allclose(lagged.values, exact, atol=1e-10)


def test_a_delayed_input_has_its_first_value_until_it_starts() -> None:
    logged = Signal(TIME, np.cos(TIME))
    delayed = delay_input(logged, 0.0125)
    values = np.interp(TIME, delayed.arrival, delayed.values)
    assert np.allclose(values, np.interp(TIME - 0.0125, TIME, logged.values), atol=1e-12)
    assert delayed.arrival[0] == 0.0


def test_no_lag_and_no_delay_leave_the_input() -> None:
    logged = Signal(TIME, TIME)
    assert lag_input(logged, 0.0) is logged
    assert delay_input(logged, 0.0) is logged
