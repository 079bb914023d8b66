# SPDX-License-Identifier: MIT
"""Sensors: stamps, noise, rounding."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.dyno.scenario import Sensor


def _sensor(rate: float = 100.0, noise: float = 3.0, resolution: float = 0.0) -> Sensor:
    return Sensor("engine_torque", Quantity.TORQUE, "EngTrq", "Nm", rate, noise, resolution)


@pytest.mark.parametrize(("rate", "count"), [(1000.0, 5001), (100.0, 501), (30.0, 151)])
def test_stamps_are_multiples_of_the_period_up_to_the_end(rate: float, count: int) -> None:
    stamps = _sensor(rate).compute_stamps(5.0)
    assert stamps.size == count
    assert stamps[-1] <= 5.0
    assert np.allclose(np.diff(stamps), 1.0 / rate, rtol=1e-12)


def test_noise_is_white_with_the_stated_deviation_and_factor() -> None:
    sensor = _sensor()
    stamps = np.arange(20000) / 100.0
    exact = np.full(stamps.size, 1500.0)
    for factor in (1.0, 2.5):
        noise = sensor.read(stamps, exact, factor, np.random.default_rng(1)).values - exact
        assert noise.std() == pytest.approx(3.0 * factor, rel=0.03)
        assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.03


def test_rounding_yields_multiples_of_the_resolution() -> None:
    stamps = np.arange(1000) / 100.0
    read = _sensor(resolution=11.0).read(stamps, stamps * 97.0, 1.0, np.random.default_rng(2))
    steps = read.values / 11.0
    assert np.allclose(steps, np.round(steps), atol=1e-9)


def test_without_noise_the_sensor_is_ideal() -> None:
    stamps = np.arange(10) / 100.0
    exact = 1000.0 + 0.123 * stamps
    read = _sensor(resolution=11.0).read(stamps, exact, 0.0, np.random.default_rng(3))
    assert np.array_equal(read.values, exact)
