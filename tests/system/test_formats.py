# SPDX-License-Identifier: MIT
"""One log as CSV, MDF, MATLAB and Parquet: the same result to round-off."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.identify_run import IdentifyOptions, run_identification
from drivetwin.dyno import dyno
from drivetwin.dyno.files import convert_channels, format_card
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.result.method import Method
from drivetwin.findings import render
from drivetwin.logs.read import read_log
from drivetwin.logs.write import write_log
from drivetwin.vehicle.card import load_card

ROUND_OFF = 1e-9
"""Relative; the files hold the same doubles, and units are converted by one factor."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One log by format, with its card beside."""
    folder = tmp_path_factory.mktemp("formats")
    bench = dyno.run(load_scenario("paper_steps"), seed=4)
    (folder / "card.toml").write_text(format_card(bench.scenario))
    paths = {suffix: folder / f"log.{suffix}" for suffix in ("csv", "mf4", "mat", "parquet")}
    for path in paths.values():
        write_log(path, convert_channels(bench))
    return paths


def test_every_format_gives_the_same_channels(logs: dict[str, Path]) -> None:
    first, *others = (read_log(one, load_card(one.with_name("card.toml"))) for one in logs.values())
    for other in others:
        assert render(other.findings) == render(first.findings)
        assert other.channels.keys() == first.channels.keys()
        for role, one in first.channels.items():
            two = other[role]
            assert two.held == one.held
            assert two.time == pytest.approx(one.time, rel=ROUND_OFF, abs=ROUND_OFF)
            assert two.values == pytest.approx(one.values, rel=ROUND_OFF, abs=ROUND_OFF)


def test_the_result_does_not_depend_on_the_format(logs: dict[str, Path]) -> None:
    """By the fast method, which uses every channel; the channels themselves are compared above."""
    request = IdentifyOptions(vehicle=logs["csv"].with_name("card.toml"), method=Method.INTEGRAL)
    first, other = (run_identification(logs[one], request).found for one in ("csv", "mf4"))
    assert render(other.findings) == render(first.findings)
    assert other.shifts[0].sigma == pytest.approx(first.shifts[0].sigma, rel=ROUND_OFF)
    quality = pytest.approx(first.shifts[0].quality, rel=ROUND_OFF, abs=ROUND_OFF)
    assert other.shifts[0].quality == quality
    for name, one in first.estimates.items():
        two = other.estimates[name]
        assert two.value == pytest.approx(one.value, rel=ROUND_OFF), name
        assert two.std_total == pytest.approx(one.std_total, rel=ROUND_OFF), name
        assert two.verdict is one.verdict
    for element, curve in first.friction.items():
        assert other.friction[element].mu == pytest.approx(curve.mu, rel=ROUND_OFF)
    for signal, phases in first.fit.items():
        for phase, fit in phases.items():
            assert other.fit[signal][phase].rmse == pytest.approx(fit.rmse, rel=1e-6)
