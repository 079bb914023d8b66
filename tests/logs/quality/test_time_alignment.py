# SPDX-License-Identifier: MIT
"""Delay and drift between speeds: found where the acceleration changes, silent where not."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.findings import Code
from drivetwin.logs.quality.time_alignment import (
    check_speed_clocks,
    estimate_speed_delay,
    estimate_speed_ratio,
)
from tests.logs.fixtures import card
from tests.support.arrays import FloatArray

RATIOS = [1.8, 1.4]
SEED = 3


def output(time: FloatArray) -> FloatArray:
    """A speed with changing acceleration: a ramp with surge."""
    return 80.0 + 2.0 * time + 3.0 * np.sin(2.0 * np.pi * 0.7 * time)


def channel(role: str, time: FloatArray, values: FloatArray) -> Channel:
    noise = np.random.default_rng(SEED).normal(0.0, 0.05, time.size)
    return Channel(role, Quantity.SPEED, time, values + noise, role, "rad/s")


def pair(delay: float, drift: float = 0.0, off: float = 1.0) -> tuple[Channel, Channel]:
    """Input speed in 2nd and 3rd gear, and the output speed whose stamps are late."""
    time = np.arange(0.0, 8.0, 0.01)
    ratio = np.where(time < 4.0, RATIOS[0], RATIOS[1]) * off
    late = time + delay + drift * (time - 4.0)
    return channel("input_speed", time, ratio * output(time)), channel(
        "output_speed", late, output(time)
    )


@pytest.mark.parametrize("delay", [0.0, 0.03, -0.02])
@pytest.mark.parametrize("off", [1.0, 1.003])
def test_the_delay_is_found_whether_or_not_the_ratio_is_exact(delay: float, off: float) -> None:
    found = estimate_speed_delay(*pair(delay, off=off), RATIOS)
    assert found is not None
    assert found.value == pytest.approx(delay, abs=max(4.0 * found.sigma, 1e-3))
    assert found.sigma < 2e-3
    assert abs(found.drift) < 5.0 * found.drift_sigma + 1e-4


def test_drift_is_found() -> None:
    found = estimate_speed_delay(*pair(0.0, drift=0.004), RATIOS)
    assert found is not None
    assert found.drift == pytest.approx(0.004, abs=max(4.0 * found.drift_sigma, 4e-4))


def test_a_delay_is_told_with_the_mapping_that_cures_it(tmp_path: Path) -> None:
    faster, slower = pair(0.03)
    channels = {one.role: one for one in (faster, slower)}
    (one,) = check_speed_clocks(channels, card(tmp_path))
    assert re.search(r"'output_speed': 29\.8.* ms late relative to 'input_speed'", one.text)
    assert "channels.output_speed.time_shift_s = -0.0298" in one.remedy
    faster, slower = pair(0.0)
    assert check_speed_clocks({one.role: one for one in (faster, slower)}, card(tmp_path)) == []


def test_an_early_engine_speed_is_brought_to_the_gearbox_speeds(tmp_path: Path) -> None:
    time = np.arange(0.0, 8.0, 0.01)
    engine = channel("engine_speed", time - 0.03, output(time))
    inlet = channel("input_speed", time, output(time))
    (one,) = check_speed_clocks({"engine_speed": engine, "input_speed": inlet}, card(tmp_path))
    assert re.search(r"'engine_speed': 29\.[89].* ms early relative to 'input_speed'", one.text)
    assert "channels.engine_speed.time_shift_s = 0.0299" in one.remedy


def test_clocks_that_drift_apart_are_told(tmp_path: Path) -> None:
    faster, slower = pair(0.0, drift=0.004)
    found = check_speed_clocks({one.role: one for one in (faster, slower)}, card(tmp_path))
    assert Code.CLOCKS_DRIFT in [one.code for one in found]


def test_steady_driving_tells_no_delay() -> None:
    time = np.arange(0.0, 8.0, 0.01)
    steady = channel("output_speed", time + 0.05, np.full(time.size, 80.0) + time)
    found = estimate_speed_delay(channel("input_speed", time, 1.8 * (80.0 + time)), steady, RATIOS)
    assert found is None or abs(found.value) < 5.0 * found.sigma


@pytest.mark.parametrize("ratio", [5.0, 5.01])
@pytest.mark.parametrize("late", [0.0, 0.05])
def test_the_ratio_is_found_whether_or_not_one_speed_is_late(ratio: float, late: float) -> None:
    time = np.arange(0.0, 8.0, 0.01)
    faster = channel("output_speed", time, output(time))
    found = estimate_speed_ratio(faster, channel("wheel_speed", time + late, output(time) / ratio))
    assert found is not None
    # The sensors' noise of 0.05 in 16 rad/s over 80 independent means of 10 samples.
    assert found.std < 3e-4 * ratio
    assert found.value == pytest.approx(ratio, abs=4.0 * found.std + 1e-4 * ratio)


@pytest.mark.parametrize("late", [0.0, 0.02])
def test_the_twist_of_a_shaft_is_no_error_of_the_ratio(late: float) -> None:
    time = np.arange(0.0, 8.0, 0.001)
    torque = 300.0 - 25.0 * time + 60.0 * np.exp(-time) * np.sin(2.0 * np.pi * 9.0 * time)
    twist, wheel = torque / 1600.0, output(time) / 5.0
    faster = channel("output_speed", time, 5.0 * wheel + np.gradient(twist, time))
    slower = channel("wheel_speed", time + late, wheel)
    measured = Channel("output_torque", Quantity.TORQUE, time, torque, "T", "Nm")
    found = estimate_speed_ratio(faster, slower, measured)
    assert found is not None
    # The sensors' noise, five times that of the wheel, in 16 rad/s over 8000 samples.
    assert found.std < 2.0 * 5.0 * 0.05 / 16.0 / 8000.0**0.5
    assert abs(found.value - 5.0) < 3.0 * found.std
    # The means of the speeds alone have the error of the twist over the angle.
    off = (twist[-1] - twist[0]) / float(np.trapezoid(wheel, time))
    assert abs(off) > 4.0 * found.std


def test_a_gap_costs_what_it_touches_only() -> None:
    time = np.arange(0.0, 8.0, 0.01)
    slower = channel("output_speed", time + 0.03, output(time))
    keep = (slower.time < 0.4) | (slower.time > 0.7)
    slower = replace(slower, time=slower.time[keep], values=slower.values[keep])
    found = estimate_speed_delay(channel("input_speed", time, 1.8 * output(time)), slower, RATIOS)
    assert found is not None
    assert found.value == pytest.approx(0.03, abs=4.0 * found.sigma)
    assert found.span > 6.0


def test_a_speed_of_repeated_means_is_not_late(tmp_path: Path) -> None:
    """Means over 20 ms, held in a table of 2 ms: by the first of each value 10 ms late."""
    fine = np.arange(0.0, 8.0, 2e-3)
    start = np.floor(fine / 0.02) * 0.02
    middle = start - 0.01
    slower = replace(channel("output_speed", fine, output(middle)), held=True)
    slower = replace(slower, values=slower.values[np.searchsorted(fine, start - 1e-6)])
    inlet = channel("input_speed", fine, 1.8 * output(fine))
    assert check_speed_clocks({"input_speed": inlet, "output_speed": slower}, card(tmp_path)) == []
    late = replace(slower, time=slower.time + 0.03)
    (one,) = check_speed_clocks({"input_speed": inlet, "output_speed": late}, card(tmp_path))
    assert one.numbers["delay"].value == pytest.approx(0.04, abs=1e-3)


def test_no_gear_held_tells_nothing() -> None:
    time = np.arange(0.0, 8.0, 0.01)
    faster = channel("input_speed", time, 2.5 * output(time))
    assert estimate_speed_delay(faster, channel("output_speed", time, output(time)), RATIOS) is None
