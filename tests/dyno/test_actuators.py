# SPDX-License-Identifier: MIT
"""Hydraulic actuators against closed-form responses."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.actuator.model import ActuatorModel
from drivetwin.dyno.actuators import Actuator, ControlledActuator, Fill, Program, Vibration
from drivetwin.errors import InputError

TIME = np.arange(2001) / 1000.0


def test_ramp_response_is_the_exact_one_of_a_first_order_lag() -> None:
    slope, lag, dead_time = 4e5, 0.05, 0.02
    command = Program(((0.5, 0.0), (1.5, slope)))
    pressure = Actuator(command, dead_time, lag).compute_pressure(TIME)
    since = np.maximum(TIME - 0.5 - dead_time, 0.0)
    exact = slope * (since - lag * (1.0 - np.exp(-since / lag)))
    ramping = TIME - dead_time <= 1.5
    assert np.abs(pressure - exact)[ramping].max() < 1e-9 * slope


def test_pressure_rests_before_the_dead_time_is_over() -> None:
    pressure = Actuator(Program(((0.1, 3e5), (0.11, 9e5))), 0.03, 0.02).compute_pressure(TIME)
    assert np.allclose(pressure[TIME <= 0.13], 3e5, rtol=1e-12)
    assert pressure[-1] == pytest.approx(9e5)


@pytest.mark.parametrize(("dead_time", "lag"), [(0.01, 0.0), (0.01, -0.1), (-0.01, 0.1)])
def test_times_that_no_actuator_has_are_refused(dead_time: float, lag: float) -> None:
    with pytest.raises(InputError, match="a dead time of"):
        Actuator(Program(((0.0, 1.0),)), dead_time, lag)


def test_vibration_is_added_only_in_its_window() -> None:
    steady = Program(((0.0, 5e5),))
    vibration = Vibration(amplitude=2e4, frequency=18.0, start=0.5, end=1.0)
    added = Actuator(steady, 0.01, 0.02, vibration).compute_pressure(TIME) - 5e5
    outside = (TIME <= 0.5) | (TIME >= 1.0)
    assert np.abs(added[outside]).max() < 1e-6
    assert np.abs(added).max() == pytest.approx(2e4, rel=0.01)
    inside = added[~outside] * np.hanning(np.count_nonzero(~outside))
    spectrum = np.abs(np.fft.rfft(inside, 8192))
    assert np.fft.rfftfreq(8192, 1e-3)[spectrum.argmax()] == pytest.approx(18.0, abs=0.3)


@pytest.mark.parametrize("knots", [(), ((0.0, 1.0), (0.0, 2.0)), ((1.0, 1.0), (0.5, 2.0))])
def test_a_program_needs_knots_in_order(knots: tuple[tuple[float, float], ...]) -> None:
    with pytest.raises(InputError, match="knots"):
        Program(knots)


def test_fill_takes_its_time_at_boost_and_longer_below() -> None:
    """The stroke goes with the root of the pressure difference: four times less, twice as long."""
    fill = Fill(spring=7e4, boost=4e5, time=0.06)
    for level, expected in ((4e5, 0.06), (7e4 + 0.25 * 3.3e5, 0.12)):
        command = Program(((0.1, 0.0), (0.1 + 1e-6, level)))
        pressure = Actuator(command, 0.0, 1e-4, fill=fill).compute_pressure(TIME)
        full = TIME[np.argmax(pressure > 1.01 * fill.spring)]
        assert full - 0.1 == pytest.approx(expected, abs=2e-3)
        assert pressure[-1] == pytest.approx(level)


def test_a_clutch_that_is_full_follows_its_command() -> None:
    command = Program(((0.5, 9e5), (1.0, 2e5)))
    fill = Fill(spring=7e4, boost=4e5, time=0.06)
    with_fill, without = (
        Actuator(command, 0.01, 0.02, fill=each).compute_pressure(TIME) for each in (fill, None)
    )
    assert np.array_equal(with_fill, without)


def test_a_controller_holds_its_command_for_a_task() -> None:
    ramp = Program(((0.5, 0.0), (1.5, 1e6)))
    controlled = ControlledActuator(ramp, ActuatorModel(0.02, 0.01, 0.01), task=0.01)
    command = controlled.compute_command(2.0)
    assert command.evaluate(np.array([0.7049, 0.705, 0.7101])).tolist() == [2e5, 2e5, 2.1e5]
    pressure = controlled.compute_pressure(TIME)
    late = 0.02 + 0.5 * 0.01 + 2.0 * 0.01  # dead time, mean hold, both stages of the lag
    assert np.interp(1.0, TIME, pressure) == pytest.approx(1e6 * (0.5 - late), rel=0.01)


@pytest.mark.parametrize("task", [0.0, -0.01])
def test_a_task_without_time_is_refused(task: float) -> None:
    with pytest.raises(InputError, match="controller task"):
        ControlledActuator(Program(((0.0, 1.0),)), ActuatorModel(0.02, 0.01, 0.01), task)
