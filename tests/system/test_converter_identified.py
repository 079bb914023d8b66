# SPDX-License-Identifier: MIT
"""The shift behind an open converter identified: values, and what its samples show."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.validation.validated_model import identify_validated
from drivetwin.vehicle.card import load_card
from tests.shifts.fixtures import shared
from tests.support.repeats import mark_repeats
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


@pytest.mark.parametrize("card", mark_repeats(["c1", "c2"], ["c2"]))
def test_a_map_that_is_off_at_each_point_is_corrected(card: str) -> None:
    """Points off by up to 3 %: the log gave no value, or a wrong cause."""
    folder = "cases/rough_converter"
    vehicle = load_card(shared(f"{folder}/{card}.toml"))
    log = read_log(shared(f"{folder}/c.csv"), vehicle)
    truth = json.loads(shared(f"{folder}/c.truth.json").read_text())["parameters"]
    found = identify_validated(log, vehicle, detect_shifts(log, vehicle))
    estimates = found.result.estimates.items()
    named = {name: one for name, one in estimates if one.verdict is Verdict.IDENTIFIED}
    assert found.result.status is ModelStatus.VALID
    assert len(named) >= 13
    for name in named.keys() & truth.keys():
        interval = named[name].ci95_total
        assert interval is not None
        assert interval[0] < truth[name]["value"] < interval[1], name
    assert vehicle.converter is not None
    assert found.twin.converter is not None
    assert found.twin.converter.capacity != vehicle.converter.capacity
