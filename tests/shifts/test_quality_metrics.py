# SPDX-License-Identifier: MIT
"""Metrics against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.shifts.quality import (
    compute_command_response_time,
    compute_duration,
    compute_largest_rate,
    compute_response_time,
    compute_vibration_dose,
)
from tests.shifts.test_summary import _SHIFT

_TIME = np.linspace(0.0, 2.0, 4001)


@given(st.floats(0.1, 50.0), st.floats(1.0, 20.0))
def test_rate_and_dose_of_a_sine(size: float, omega: float) -> None:
    wave = np.asarray(size * np.sin(omega * _TIME))
    assert compute_largest_rate(_TIME, wave) == pytest.approx(size * omega, rel=1e-3)
    whole = np.asarray(size * np.sin(np.pi * _TIME))
    # The mean of sin^4 over whole half periods is 3/8.
    expected = size * (0.375 * 2.0) ** 0.25
    assert compute_vibration_dose(_TIME, whole) == pytest.approx(expected, rel=1e-5)


def test_duration_counts_from_the_torque_phase_to_lock_up() -> None:
    assert compute_duration(_SHIFT) == pytest.approx(0.5)


def _request(*changes: tuple[float, float]) -> Channel:
    time = np.arange(-5.0, 3.0, 0.01)
    values = np.full(time.size, 2.0)
    for when, gear in changes:
        values[time >= when - 1e-9] = gear
    return Channel("requested_gear", Quantity.STATE, time, values, "GearReq", "1")


def test_response_counts_from_the_last_request_of_the_gear() -> None:
    request = _request((-0.5, 3.0), (0.0, 2.0), (0.8, 3.0))
    assert compute_response_time(request, _SHIFT) == pytest.approx(0.4)


@pytest.mark.parametrize("changes", [(), ((1.4, 3.0),), ((-4.0, 3.0),), ((0.8, 4.0),)])
def test_no_response_without_a_request_of_this_shift(changes: tuple[tuple[float, float]]) -> None:
    assert compute_response_time(_request(*changes), _SHIFT) is None


def _command(*changes: tuple[float, float]) -> Channel:
    """Return a commanded pressure [Pa] that is zero before the first change."""
    time = np.arange(-5.0, 3.0, 0.01)
    values = np.zeros(time.size)
    for when, pressure in changes:
        values[time >= when - 1e-9] = pressure
    return Channel("pressure_command.B3", Quantity.PRESSURE, time, values, "p_B3_soll", "Pa")


def test_response_counts_from_the_fill_of_the_oncoming_element() -> None:
    """A fill pulse, the kiss pressure, and the ramp: the first of them is the request."""
    command = _command((0.5, 6e5), (0.6, 1e5), (1.0, 1e6))
    assert compute_command_response_time(command, _SHIFT) == pytest.approx(0.7)


@pytest.mark.parametrize("changes", [(), ((1.3, 1e6),), ((-4.0, 1e6),)])
def test_no_response_without_a_command(changes: tuple[tuple[float, float]]) -> None:
    """Of none, of one after the inertia phase began, of one that was there before."""
    assert compute_command_response_time(_command(*changes), _SHIFT) is None


def test_no_response_of_a_gear_without_a_number() -> None:
    assert compute_response_time(_request((0.8, 3.0)), replace(_SHIFT, end_gear="D")) is None
