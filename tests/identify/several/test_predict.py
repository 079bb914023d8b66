# SPDX-License-Identifier: MIT
"""What a fit expects of a shift it has not seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.identify.inputs import signals_of
from drivetwin.identify.profile import likelihood_of
from drivetwin.identify.several.predict import Expected, expected
from tests.identify.several.made import LOADS, card, pair, together
from tests.support.shared_results import shared


@shared
def _of_second() -> Expected:
    """The second log of the pair as if it were unknown to a fit that it took part in."""
    second = pair()[1]
    signals = replace(signals_of(second.log, card(), second.shifts.shifts[0]), log=9)
    return expected(likelihood_of(together().found)[0], [signals], card())[0]


def test_load_and_age_come_from_the_gear_before_the_shift() -> None:
    own = _of_second().own
    assert set(own) >= {"Tv_over_if", "te_delay"}
    for name, truth in (("Tv_over_if", LOADS[1]), ("te_delay", 0.010)):
        value, std = own[name]
        assert 0.0 < std < 0.01 * max(truth, 1.0)
        assert abs(value - truth) < 5.0 * std


def test_no_error_is_allowed_below_the_sensor_noise() -> None:
    second = pair()[1]
    signals = signals_of(second.log, card(), second.shifts.shifts[0])
    sigma = {
        "output_torque": signals.output_torque.sigma,
        "engine_speed": signals.engine_speed.sigma,
        "output_speed": signals.output_speed.sigma,
    }
    for name, noise in sigma.items():
        bound = _of_second().bounds[name]
        assert noise * 0.95 < bound.usual < bound.largest < 6.0 * noise


def test_a_log_of_the_fit_keeps_its_own() -> None:
    second = pair()[1]
    signals = replace(signals_of(second.log, card(), second.shifts.shifts[0]), log=2)
    fit = likelihood_of(together().found)[0]
    assert expected(fit, [signals], card())[0].own == {}


def test_equal_seeds_give_equal_bounds() -> None:
    second = pair()[1]
    signals = replace(signals_of(second.log, card(), second.shifts.shifts[0]), log=9)
    again = expected(likelihood_of(together().found)[0], [signals], card())[0]
    assert again.bounds == _of_second().bounds
    assert np.isclose(again.mean_speed, _of_second().mean_speed)
