# SPDX-License-Identifier: MIT
"""A run is reproducible, and its channels are the trajectory seen by the sensors."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError


def test_same_seed_gives_the_same_bits_and_another_seed_other_noise() -> None:
    first, again, other = (run(load_scenario("paper"), seed) for seed in (7, 7, 8))
    for one, two, three in zip(first.channels, again.channels, other.channels, strict=True):
        assert np.array_equal(one.values, two.values)
        assert not np.array_equal(one.values, three.values)


def test_noise_of_two_channels_is_independent() -> None:
    noisy = {channel.role: channel.values for channel in run(load_scenario("paper")).channels}
    exact = {
        channel.role: channel.values for channel in run(load_scenario("paper"), noise=0.0).channels
    }
    a, b = (noisy[role] - exact[role] for role in ("input_speed", "output_speed"))
    assert abs(np.corrcoef(a, b)[0, 1]) < 0.05


def test_ideal_sensors_show_the_trajectory() -> None:
    bench = run(load_scenario("paper"), noise=0.0)
    speed = next(c for c in bench.channels if c.role == "input_speed")
    exact = np.interp(speed.time, bench.trajectory.time, bench.trajectory.engine_speed)
    assert np.allclose(speed.values, exact, rtol=1e-12)


def test_engine_torque_is_as_old_as_te_delay_says() -> None:
    bench = run(load_scenario("paper_steps"), noise=0.0)
    channel = next(c for c in bench.channels if c.role == "engine_torque")
    delay = bench.truth.parameters["te_delay"]
    assert delay == pytest.approx(0.010)
    asked = bench.scenario.compute_torque(np.maximum(channel.time - delay, 0.0))
    assert np.allclose(channel.values, asked, rtol=1e-9)


@pytest.mark.parametrize("noise", [-1.0, float("nan"), float("inf")])
def test_noise_factor_must_be_finite_and_not_negative(noise: float) -> None:
    with pytest.raises(InputError, match="noise"):
        run(load_scenario("paper"), noise=noise)
