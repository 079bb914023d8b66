# SPDX-License-Identifier: MIT
"""Start values of a log without an output torque."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.dyno.files import format_card
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import PLAUSIBLE_ETA, DesignData, MeasuredSignal
from drivetwin.estimation.likelihood.optimize.initial_guess import (
    estimate_without_torque,
)
from drivetwin.vehicle.card import load_card
from tests.support.bench import Knowledge, record_bench

NOISY = 4.0
"""Noise of the speeds, a multiple of the scenario's."""


def _design(file: Path) -> DesignData:
    card = load_card(file)
    return DesignData(
        card.loss_law, card.final_drive.value, card.J_prime_range, card.J_vehicle_range
    )


def test_noise_of_the_speeds_does_not_make_the_vehicle_light(tmp_path: Path) -> None:
    scenario = load_scenario("paper")
    loud = tuple(
        replace(one, noise=NOISY * one.noise) if one.role.endswith("speed") else one
        for one in scenario.sensors
    )
    made = record_bench(replace(scenario, sensors=loud), 0, Knowledge())
    file = tmp_path / "card.toml"
    file.write_text(format_card(scenario), encoding="utf-8")
    signals = replace(made.signals, output_torque=MeasuredSignal(np.empty(0), np.empty(0)))
    guess = estimate_without_torque(signals, made.driveline, _design(file))
    eta = scenario.model.eta
    assert guess["J_vehicle"] == pytest.approx(made.truth["J_vehicle"] / eta, rel=0.1)
    assert guess["Tv_over_if"] == pytest.approx(made.truth["Tv_over_if"] / eta, rel=0.1)


def test_a_gear_held_too_briefly_leaves_the_start_to_the_other(tmp_path: Path) -> None:
    scenario = load_scenario("paper")
    made = record_bench(scenario, 0, Knowledge())
    file = tmp_path / "card.toml"
    file.write_text(format_card(scenario), encoding="utf-8")
    shift = made.signals.shift
    brief = replace(shift, before=(shift.before[1] - 0.08, shift.before[1]))
    guess = estimate_without_torque(
        replace(made.signals, shift=brief), made.driveline, _design(file)
    )
    assert guess["eta"] == PLAUSIBLE_ETA.value
    assert guess["J_vehicle"] == pytest.approx(made.truth["J_vehicle"], rel=0.5)
