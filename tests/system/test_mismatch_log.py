# SPDX-License-Identifier: MIT
"""Logs of vehicles that depart from the model, as studies of validity use them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.effects import EffectId
from tests.support.repeats import mark_repeats

DAILY = (EffectId.AERO_LOAD, EffectId.TYRE_SLIP, EffectId.INPUT_SHAFT_MODE)
"""A load, an effect of the driveline and one that takes another network."""
SIZES = {EffectId.INPUT_SHAFT_MODE: 60.0, EffectId.AERO_LOAD: 0.1}


@pytest.mark.parametrize("effect", mark_repeats(EffectId, DAILY))
def test_every_effect_leaves_a_shift_to_identify(effect: EffectId) -> None:
    made = make_mismatch_log(4, effect, SIZES.get(effect, 0.003), Rates.LOGGER)
    (shift,) = detect_shifts(made.log, made.card).shifts
    assert (shift.start_gear, shift.end_gear) == ("2", "3")
    assert list(made.recorded.truth.effects) == [effect]


@pytest.mark.parametrize(("rates", "step"), [(Rates.LOGGER, 0.001), (Rates.BUS, 0.02)])
def test_rates_are_those_of_the_log(rates: Rates, step: float) -> None:
    made = make_mismatch_log(2, None, 0.0, rates)
    assert np.diff(made.log["input_speed"].time) == pytest.approx(step)
    assert np.diff(made.log["engine_torque"].time).min() > 0.009
    assert made.recorded.truth.effects == {}


def test_stated_tolerances_are_on_the_card_and_in_the_log() -> None:
    exact, wrong = (
        make_mismatch_log(2, None, 0.0, Rates.BUS, tolerances=stated) for stated in (False, True)
    )
    assert not exact.card.sensors
    assert wrong.card.sensors["output_torque"].gain == 0.01
    ratio = wrong.log["output_torque"].values / exact.log["output_torque"].values
    assert abs(np.median(ratio) - 1.0) > 1e-4


def test_backlash_is_crossed() -> None:
    made = make_mismatch_log(3, EffectId.BACKLASH, 0.02, Rates.LOGGER)
    motion = made.recorded.trajectory
    assert np.count_nonzero(motion.shaft_torque == 0.0) > 5
    assert motion.shaft_torque.min() < 0.0
