# SPDX-License-Identifier: MIT
"""Where a simulation may start."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.validation.initial_state import find_quiescent_time
from tests.shifts.fixtures import make_log
from tests.support.arrays import FloatArray

_TIME = np.arange(0.0, 4.0, 1e-3)


def _log(torque: FloatArray, noise: float) -> ShiftLog:
    rng = np.random.default_rng(3)
    return make_log({"output_torque": (_TIME, torque + noise * rng.normal(size=_TIME.size))})


@pytest.mark.parametrize("noise", [0.0, 40.0])
def test_a_steady_torque_is_calm_at_once(noise: float) -> None:
    assert find_quiescent_time(_log(np.full_like(_TIME, 2000.0), noise), (0.25, 3.0)) == 0.25


def test_a_lock_up_oscillation_is_waited_for() -> None:
    ringing = 2000.0 + 3000.0 * np.exp(-5.0 * _TIME) * np.sin(2.0 * np.pi * 12.0 * _TIME)
    start = find_quiescent_time(_log(ringing, 40.0), (0.05, 3.5))
    assert np.exp(-5.0 * start) < 0.05
    assert start < 1.2


def test_without_output_torque_the_span_decides() -> None:
    log = make_log({"input_speed": (_TIME, np.full_like(_TIME, 150.0))})
    assert find_quiescent_time(log, (0.3, 3.0)) == 0.3
