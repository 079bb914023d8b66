# SPDX-License-Identifier: MIT
"""Hydraulic actuators against closed-form responses."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError

TIME = np.arange(2001) / 1000.0
Knots = tuple[tuple[float, float], ...]


def _load(scenario: str, knots: Knots, **changes: Any) -> Any:
    """Return the actuator of B3, or of C3, of a scenario with another command."""
    actuators = load_scenario(scenario).actuators
    one: Any = actuators.get("B3") or actuators["C3"]
    return replace(one, command=replace(one.command, knots=knots), **changes)


def _lag(knots: Knots, dead_time: float, lag: float, **changes: Any) -> Any:
    plain = {"vibration": None, "fill": None}
    return _load("paper", knots, dead_time=dead_time, lag=lag, **{**plain, **changes})


def test_ramp_response_is_the_exact_one_of_a_first_order_lag() -> None:
    slope, lag, dead_time = 4e5, 0.05, 0.02
    pressure = _lag(((0.5, 0.0), (1.5, slope)), dead_time, lag).compute_pressure(TIME)
    since = np.maximum(TIME - 0.5 - dead_time, 0.0)
    exact = slope * (since - lag * (1.0 - np.exp(-since / lag)))
    ramping = TIME - dead_time <= 1.5
    assert np.abs(pressure - exact)[ramping].max() < 1e-9 * slope


def test_vibration_is_added_only_in_its_window() -> None:
    wave = load_scenario("paper").actuators["B3"].vibration  # type: ignore[union-attr] # a lag
    assert wave is not None
    wave = replace(wave, amplitude=2e4, frequency=18.0, start=0.5, end=1.0)
    added = _lag(((0.0, 5e5),), 0.01, 0.02, vibration=wave).compute_pressure(TIME) - 5e5
    outside = (TIME <= 0.5) | (TIME >= 1.0)
    assert np.abs(added[outside]).max() < 1e-6
    assert np.abs(added).max() == pytest.approx(2e4, rel=0.01)
    inside = added[~outside] * np.hanning(np.count_nonzero(~outside))
    spectrum = np.abs(np.fft.rfft(inside, 8192))
    assert np.fft.rfftfreq(8192, 1e-3)[spectrum.argmax()] == pytest.approx(18.0, abs=0.3)


def test_fill_takes_its_time_at_boost_and_longer_below() -> None:
    """The stroke goes with the root of the pressure difference: four times less, twice as long."""
    fill = replace(_load("gearbox", ((0.0, 0.0),)).fill, spring=7e4, boost=4e5, time=0.06)
    for level, expected in ((4e5, 0.06), (7e4 + 0.25 * 3.3e5, 0.12)):
        knots = ((0.1, 0.0), (0.1 + 1e-6, level))
        pressure = _lag(knots, 0.0, 1e-4, fill=fill).compute_pressure(TIME)
        full = TIME[np.argmax(pressure > 1.01 * fill.spring)]
        assert full - 0.1 == pytest.approx(expected, abs=2e-3)
        assert pressure[-1] == pytest.approx(level)
    falling = ((0.5, 9e5), (1.0, 2e5))
    with_fill, without = (
        _lag(falling, 0.01, 0.02, fill=each).compute_pressure(TIME) for each in (fill, None)
    )
    assert np.array_equal(with_fill, without), "a clutch that is full follows its command"


def test_a_controller_holds_its_command_for_a_task() -> None:
    controlled = _load("hydraulics", ((0.5, 0.0), (1.5, 1e6)), task=0.01)
    model = replace(controlled.model, dead_time=0.02, rising_lag=0.01, falling_lag=0.01)
    controlled = replace(controlled, model=model)
    command = controlled.compute_command(2.0)
    assert command.evaluate(np.array([0.7049, 0.705, 0.7101])).tolist() == [2e5, 2e5, 2.1e5]


@pytest.mark.parametrize(
    ("knots", "dead_time", "lag", "match"),
    [
        (((0.0, 1.0),), 0.01, 0.0, "a dead time of"),
        (((0.0, 1.0),), -0.01, 0.1, "a dead time of"),
        ((), 0.01, 0.1, "knots"),
        (((1.0, 1.0), (0.5, 2.0)), 0.01, 0.1, "knots"),
    ],
)
def test_times_that_no_actuator_has_are_refused(
    knots: Knots, dead_time: float, lag: float, match: str
) -> None:
    with pytest.raises(InputError, match=match):
        _lag(knots, dead_time, lag)
    with pytest.raises(InputError, match="controller task"):
        _load("hydraulics", ((0.0, 1.0),), task=0.0)
