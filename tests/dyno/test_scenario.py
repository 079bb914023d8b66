# SPDX-License-Identifier: MIT
"""Torque reduction of the TCU."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError


@pytest.mark.parametrize("fraction", [-0.1, 1.0, 30.0])
def test_a_torque_reduction_must_be_a_share(fraction: float) -> None:
    with pytest.raises(InputError, match="share"):
        load_scenario("paper").set_torque_reduction(fraction)


def _get_sensor(**changes: Any) -> Any:
    sensors = load_scenario("paper").sensors
    torque = next(one for one in sensors if one.role == "engine_torque")
    return replace(torque, **{"rate": 100.0, "noise": 3.0, "resolution": 0.0, **changes})


@pytest.mark.parametrize(("rate", "count"), [(1000.0, 5001), (30.0, 151)])
def test_stamps_are_multiples_of_the_period_up_to_the_end(rate: float, count: int) -> None:
    stamps = _get_sensor(rate=rate).compute_stamps(5.0)
    assert stamps.size == count
    assert stamps[-1] <= 5.0
    assert np.allclose(np.diff(stamps), 1.0 / rate, rtol=1e-12)


def test_noise_is_white_with_the_stated_deviation_and_rounding_has_its_step() -> None:
    stamps = np.arange(20000) / 100.0
    exact = 1500.0 + 0.123 * stamps
    for factor in (1.0, 2.5):
        rng = np.random.default_rng(1)
        noise = _get_sensor().read(stamps, exact, factor, rng).values - exact
        assert noise.std() == pytest.approx(3.0 * factor, rel=0.03)
        assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.03
    rounding = _get_sensor(resolution=11.0)
    steps = rounding.read(stamps, exact, 1.0, np.random.default_rng(2)).values / 11.0
    assert np.allclose(steps, np.round(steps), atol=1e-9)
    ideal = rounding.read(stamps, exact, 0.0, np.random.default_rng(3)).values
    assert np.array_equal(ideal, exact)
