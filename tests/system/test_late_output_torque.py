# SPDX-License-Identifier: MIT
"""A late output torque beside another effect: the delay that the log check has found is the start
of the fit."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import drivetwin
from benchmarks.estimation.validity import identify_validated
from drivetwin.cli import main
from drivetwin.findings import Code


def make_log(path: Path, *effects: str) -> None:
    """Make a log with effects, its card and its truth beside it."""
    named = [part for one in effects for part in ("--effect", one)]
    assert main(["synth", "--seed", "5", *named, "-o", str(path)]) == 0


@pytest.mark.exhaustive
@pytest.mark.timeout(600)  # 45 s of CPU time: two effects, and the tyre as an element
def test_the_fit_starts_from_the_part_of_a_found_delay_that_is_none_of_the_tyre(
    tmp_path: Path,
) -> None:
    """By the vehicle's acceleration the torque is 25 ms late; the fit from there, or from no delay,
    reaches no minimum."""
    path = tmp_path / "log.csv"
    make_log(path, "output_torque_delay=0.011", "tyre_slip=0.004")
    card = drivetwin.load_card(tmp_path / "log.card.toml")
    found = identify_validated(drivetwin.read_log(path, card), card)
    (moved,) = (one for one in found.findings if one.code is Code.OUTPUT_TORQUE_ALIGNED)
    assert moved.numbers["shift"].value == pytest.approx(-0.011, abs=1e-3)
    truth = json.loads((tmp_path / "log.truth.json").read_text())["parameters"]
    names = [name for name in truth if name in found.estimates]
    assert len(names) >= 12
    for name in names:
        one = found.estimates[name]
        assert one.value is not None, name
        assert one.std_total, name
        # Of twelve intervals of 95 % one in two logs misses the truth.
        assert abs(one.value - truth[name]["value"]) < 3.0 * one.std_total, name
    assert found.status.value != "not valid"
