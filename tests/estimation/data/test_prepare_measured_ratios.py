# SPDX-License-Identifier: MIT
"""Ratios by the speeds of a shift, with the card as prior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.data.prepare import measure_ratios, refine_ratios
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.parameters import FINAL_DRIVE
from drivetwin.simulation.variable import Variable
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench

TRUTH = {"ratio_2": 2.5, "ratio_3": 1.95, "i_f": 4.5}
"""Ratios of the bench."""


def rough_driveline(std: float = 0.006) -> KnownDriveline:
    """The driveline of the bench as a card has it whose ratios are cut to two digits."""
    known = bench().driveline

    def wrong(name: str) -> PriorValue:
        return PriorValue(TRUTH[name] - 0.005, std)

    couplings = {
        one.name: replace(one, follows_ratio=True).replace_ratio(wrong(f"ratio_{one.gear}").value)
        for one in known.couplings.values()
    }
    return replace(
        known,
        i_f=wrong("i_f").value,
        offgoing=couplings[known.offgoing.name],
        oncoming=couplings[known.oncoming.name],
        couplings=couplings,
        final_drive=wrong("i_f"),
        ratios={"2": wrong("ratio_2"), "3": wrong("ratio_3")},
    )


def test_the_speeds_measure_the_ratios_within_their_noise() -> None:
    found = measure_ratios(bench().signals, rough_driveline())
    for name, truth in TRUTH.items():
        assert abs(found[name].value - truth) < 4.0 * found[name].std, name
        assert found[name].std < 1e-4 * truth


def test_a_roughly_known_ratio_is_that_of_the_log_and_an_exact_one_stays() -> None:
    rough = refine_ratios(rough_driveline(), bench().signals)
    assert rough.ratio_values == pytest.approx(TRUTH, rel=1e-4)
    exact = refine_ratios(rough_driveline(std=0.0), bench().signals)
    assert exact.ratio_values == pytest.approx({n: v - 0.005 for n, v in TRUTH.items()})


def test_without_a_wheel_speed_the_final_drive_is_that_of_the_card() -> None:
    signals = replace(bench().signals, wheel_speed=None)
    assert FINAL_DRIVE not in measure_ratios(signals, rough_driveline())
    assert refine_ratios(rough_driveline(), signals).i_f == pytest.approx(4.495)


def test_a_brake_has_both_ratios_of_eq_15_from_its_gear() -> None:
    one = rough_driveline().oncoming.replace_ratio(1.95)
    assert (1.0 / one.a, one.b) == pytest.approx((0.95, 1.95 / 0.95))
    step = 1e-6
    ahead, behind = (one.replace_ratio(1.95 + sign * step) for sign in (1.0, -1.0))
    slopes = ((1.0 / ahead.a - 1.0 / behind.a) / (2 * step), (ahead.b - behind.b) / (2 * step))
    varied = one.replace_ratio(Variable(1.95, np.ones(1)))
    for number, slope in zip((1.0 / varied.a, varied.b), slopes, strict=True):
        assert isinstance(number, Variable)
        assert number.slopes == pytest.approx(slope, rel=1e-6)


def test_a_clutch_keeps_its_own_ratio() -> None:
    one = replace(rough_driveline().oncoming, follows_ratio=False, a=0.8, b=0.8 * 1.95)
    moved = one.replace_ratio(1.5)
    assert (moved.a, moved.b) == pytest.approx((0.8, 0.8 * 1.5))
    varied = one.replace_ratio(Variable(1.5, np.ones(1)))
    assert not isinstance(varied.a, Variable)
    assert isinstance(varied.b, Variable)
    assert varied.b.slopes == pytest.approx(0.8)


def test_noise_that_hides_the_motion_measures_nothing() -> None:
    signals = bench().signals
    still = replace(signals.output_speed, values=np.zeros_like(signals.output_speed.values))
    assert measure_ratios(replace(signals, output_speed=still), rough_driveline()) == {}
