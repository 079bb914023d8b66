# SPDX-License-Identifier: MIT
"""The shift behind an open converter identified: values, and what its samples show."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.prepare import prepare
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card


def test_noise_that_turbine_and_its_torque_share_is_no_sign_of_means(tmp_path: Path) -> None:
    made = run(load_scenario("open_converter"), seed=0)
    path, card_path, _ = write_run(tmp_path / "open.csv", made)
    card = load_card(card_path)
    log = read_log(path, card)
    shifts = detect_shifts(log, card)
    found = identify(log, card, shifts)
    # Taken for noise of its own, Q fell by 32 for means of all outputs, and J_prime_2 was 3 σ off.
    codes = {one.code for one in found.findings}
    assert Code.MEAN_SAMPLES not in codes
    assert Code.CONVERTER_MAP_EXACT in codes
    for name in ("eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "k_o"):
        one, truth = found.estimates[name], made.truth.parameters[name]
        assert one.value is not None
        assert one.std_noise is not None
        assert one.value == pytest.approx(truth, abs=2.0 * one.std_noise), name
    (driveline,) = prepare(log, card, shifts).drivelines
    assert driveline.known["te_delay"].std == 0.0
