# SPDX-License-Identifier: MIT
"""A bench log with cards as people write them: ratios of two to six digits."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import drivetwin
from benchmarks.estimation.validity import identify_validated
from drivetwin.cli import main
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from tests.support.repeats import mark_repeats

CASE = Path(__file__).resolve().parents[3] / "shared" / "cases" / "rounded_card"
pytestmark = pytest.mark.skipif(not CASE.is_dir(), reason="the shared cases are not at hand")


def load_truth() -> dict[str, float]:
    """Truth by parameter id."""
    truth = json.loads((CASE / "truth.json").read_text())
    return {
        "eta": truth["eta"],
        "J_prime_1": truth["Jp"][0],
        "J_prime_2": truth["Jp"][1],
        "J_out": truth["Jo"],
        "J_vehicle": truth["J3"],
        "Tv_over_if": truth["tv0"],
        "k_o": truth["k"],
        "c_o": truth["c"],
        "zeta_2": truth["zeta"],
        "P0.K1": truth["P0"][0],
        "P0.K2": truth["P0"][1],
        "ratio_1": truth["ig"][0],
        "ratio_2": truth["ig"][1],
        "i_f": truth["i_f"],
    }


def evaluate_truth(slip: float) -> float:
    """True μ of K2."""
    law = json.loads((CASE / "truth.json").read_text())["mu"][1]
    fall = (law["mu_s"] - law["mu_c"]) * np.exp(-slip / law["vs"])
    return float(law["mu_c"] + fall + law["mu_v"] * slip)


@pytest.mark.parametrize("card", mark_repeats(["card", "card2"], ["card2"]))
def test_the_values_are_true_with_rounded_ratios(card: str) -> None:
    vehicle = drivetwin.load_card(CASE / f"{card}.toml")
    found = identify_validated(drivetwin.read_log(CASE / "Schaltung_23.csv", vehicle), vehicle)
    assert found.status.is_confirmed
    truth, gain = load_truth(), json.loads((CASE / "truth.json").read_text())["gain"][1]
    curve = found.friction["K2"]
    truth["mu_gain.K2"] = gain * evaluate_truth(curve.middle_slip)
    identified = [n for n, one in found.estimates.items() if one.verdict is Verdict.IDENTIFIED]
    assert len([name for name in identified if name not in ("ratio_1", "ratio_2", "i_f")]) >= 11
    for name in identified:
        if name in truth:
            low, high = found.estimates[name].ci95_total or (0.0, 0.0)
            assert low <= truth[name] <= high, name
    assert curve.verdict is Verdict.IDENTIFIED
    refined = {one.subject for one in found.findings if one.code is Code.RATIO_REFINED}
    assert refined == {"ratio_1", "ratio_2", "i_f"}


def test_the_check_of_the_card_names_what_the_log_knows_better(
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = [str(CASE / name) for name in ("card2.toml", "Schaltung_23.csv")]
    assert main(["card", "check", *files, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["findings"]
    reported = {one["subject"]: one["numbers"] for one in found if one["code"] == "ratio_refined"}
    truth = load_truth()
    assert set(reported) == {"ratio_1", "ratio_2", "i_f"}
    for name, numbers in reported.items():
        assert numbers["log"]["value"] == pytest.approx(truth[name], rel=5e-5)
