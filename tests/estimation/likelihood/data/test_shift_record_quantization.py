# SPDX-License-Identifier: MIT
"""Rounding that no noise dithers: an error of each level, not one of each sample."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli.synth import write_run
from drivetwin.dyno.actuators import Actuator
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.shift_record import estimate_quantization
from drivetwin.estimation.result.estimate import Z95
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card

COARSE = 16e3
"""Rounding step of the pressures [Pa]: as coarse as on a bus."""
STEP = 11.0
"""Rounding step [N m] of a torque of 800 N m: as coarse as on a bus."""


def test_each_stay_at_a_level_has_an_error_of_its_own() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    values = np.where(time < 0.395, 110.0, 121.0)
    sigma = STEP / np.sqrt(12.0)
    found = estimate_quantization(MeasuredSignal(time, values, sigma), STEP)
    assert found is not None
    assert list(np.bincount(found.stay)) == [40, 60]
    # The mean over a stay of independent samples with this noise is off by the error of one.
    assert found.sigma[0] / np.sqrt(40) == pytest.approx(found.error)
    assert found.sigma[-1] / np.sqrt(60) == pytest.approx(found.error)
    drawn = found.draw(np.random.default_rng(1))
    assert np.unique(drawn).size == 2


@pytest.mark.parametrize(("step", "noise"), [(0.0, 1.0), (1.0, 2.0)])
def test_what_noise_dithers_leaves_nothing(step: float, noise: float) -> None:
    time = np.arange(0.0, 1.0, 0.01)
    values = 100.0 + noise * np.random.default_rng(1).standard_normal(time.size)
    rounded = np.round(values / step) * step if step else values
    found = estimate_quantization(MeasuredSignal(time, rounded, noise), step)
    assert found is None


def test_intervals_hold_where_the_engine_torque_has_no_noise_but_its_rounding(
    tmp_path: Path,
) -> None:
    exact = load_scenario("paper_steps")
    sensors = tuple(
        replace(one, noise=0.0, resolution=STEP) if one.quantity == "engine_torque" else one
        for one in exact.sensors
    )
    made = run(replace(exact, sensors=sensors), seed=110)
    path, card_path, _ = write_run(tmp_path / "rounded.csv", made)
    card = load_card(card_path)
    log = read_log(path, card)
    found = identify(log, card, detect_shifts(log, card), Method.LIKELIHOOD)
    # By one error of all levels η was 7.8, J_prime_2 4.6 and J_vehicle 3.1 deviations off.
    for name in ("eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "k_o"):
        one, truth = found.estimates[name], made.truth.parameters[name]
        assert one.value is not None
        assert one.std_total is not None
        assert one.value == pytest.approx(truth, abs=2.5 * one.std_total), name


def test_intervals_hold_where_pressures_have_no_noise_but_their_rounding(tmp_path: Path) -> None:
    exact = load_scenario("paper_steps")
    still = {
        name: replace(one, vibration=None)
        for name, one in exact.actuators.items()
        if isinstance(one, Actuator)
    }
    sensors = tuple(
        replace(one, noise=0.0, resolution=COARSE) if one.quantity == "pressure" else one
        for one in exact.sensors
    )
    made = run(replace(exact, actuators=still, sensors=sensors), seed=1)
    path, card_path, _ = write_run(tmp_path / "rounded.csv", made)
    card = load_card(card_path)
    log = read_log(path, card)
    curve = identify(log, card, detect_shifts(log, card), Method.LIKELIHOOD).friction["B3"]
    assert curve.mu is not None
    std = (curve.mu_hi - curve.mu_lo) / (2.0 * Z95)
    law = next(one.friction for one in exact.model.elements if one.name == "B3")
    # As noise of single samples the rounding left μ 3.6 deviations off.
    assert np.max(np.abs(curve.mu - law.evaluate(curve.slip)) / std) < 2.5
