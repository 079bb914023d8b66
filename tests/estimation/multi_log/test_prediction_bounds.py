# SPDX-License-Identifier: MIT
"""What a fit expects of a shift it has not seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.data.prepare import prepare_shift
from drivetwin.estimation.data.shift_data import ShiftData
from drivetwin.estimation.multi_log.prediction_bounds import ShiftPrediction, predict_shifts
from tests.estimation.multi_log.fixtures import LOADS, card, pair, together
from tests.support.shared_results import shared


def _prepared(number: int) -> ShiftData:
    """The shift of the second log of the pair, as one of the log `number`."""
    second = pair()[1]
    data = prepare_shift(second.log, card(), second.shifts.shifts[0])
    return replace(data, signals=replace(data.signals, log=number))


@shared
def _of_second() -> ShiftPrediction:
    """The second log of the pair as if it were unknown to a fit that it took part in."""
    data = _prepared(9)
    return predict_shifts(get_likelihood_fit(together().found)[0], [data])[0]


def test_load_and_age_come_from_the_gear_before_the_shift() -> None:
    own = _of_second().own
    assert set(own) >= {"Tv_over_if", "te_delay"}
    for name, truth in (("Tv_over_if", LOADS[1]), ("te_delay", 0.010)):
        value, std = own[name]
        assert 0.0 < std < 0.01 * max(truth, 1.0)
        assert abs(value - truth) < 5.0 * std


def test_no_error_is_allowed_below_the_sensor_noise() -> None:
    signals = _prepared(9).signals
    sigma = {
        "output_torque": signals.output_torque.sigma,
        "engine_speed": signals.engine_speed.sigma,
        "output_speed": signals.output_speed.sigma,
    }
    for name, noise in sigma.items():
        bound = _of_second().bounds[name]
        assert noise * 0.95 < bound.usual < bound.largest < 6.0 * noise


def test_a_log_of_the_fit_keeps_its_own() -> None:
    data = _prepared(2)
    fit = get_likelihood_fit(together().found)[0]
    assert predict_shifts(fit, [data])[0].own == {}


def test_equal_seeds_give_equal_bounds() -> None:
    data = _prepared(9)
    again = predict_shifts(get_likelihood_fit(together().found)[0], [data])[0]
    assert again.bounds == _of_second().bounds
    assert np.isclose(again.mean_speed, _of_second().mean_speed)
