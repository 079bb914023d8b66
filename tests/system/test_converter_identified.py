# SPDX-License-Identifier: MIT
"""The shift behind an open converter identified: values, and what its samples show."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from tests.support.synth import synthesize


def test_noise_that_turbine_and_its_torque_share_is_no_sign_of_means(tmp_path: Path) -> None:
    path, card_path, truth_path = synthesize(tmp_path / "open.csv", "open_converter")
    truth = json.loads(truth_path.read_text())["parameters"]
    card = load_card(card_path)
    log = read_log(path, card)
    shifts = detect_shifts(log, card)
    found = identify(log, card, shifts)
    # Taken for noise of its own, Q fell by 32 for means of all outputs, and J_prime_2 was 3 σ off.
    codes = {one.code for one in found.findings}
    assert Code.MEAN_SAMPLES not in codes
    assert Code.CONVERTER_MAP_EXACT in codes
    for name in ("eta", "J_prime_2", "J_prime_3", "J_vehicle", "Tv_over_if", "k_o"):
        one = found.estimates[name]
        assert one.value is not None
        assert one.std_noise is not None
        assert one.value == pytest.approx(truth[name]["value"], abs=2.0 * one.std_noise), name
