# SPDX-License-Identifier: MIT
"""One log as CSV, MDF, MATLAB and Parquet: the same result to round-off."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli.identify_run import Request, run_identification
from drivetwin.dyno import dyno
from drivetwin.dyno.files import convert_channels, format_card
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.findings import render
from drivetwin.logs.write import write_log

ROUND_OFF = 1e-9
"""Relative; the files hold the same doubles, and units are converted by one factor."""


def results(folder: Path, method: Method) -> dict[str, Identification]:
    bench = dyno.run(load_scenario("paper_steps"), seed=4)
    card = folder / "card.toml"
    card.write_text(format_card(bench.scenario))
    found = {}
    for suffix in ("csv", "mf4", "mat", "parquet"):
        log = folder / f"log.{suffix}"
        write_log(log, convert_channels(bench))
        found[suffix] = run_identification(log, Request(card, None, method)).found
    return found


def test_the_result_does_not_depend_on_the_format(tmp_path: Path) -> None:
    first, *others = results(tmp_path, Method.LIKELIHOOD).values()
    assert first.method is Method.LIKELIHOOD
    for other in others:
        assert render(other.findings) == render(first.findings)
        assert [s.quality for s in other.shifts] == [
            pytest.approx(s.quality, rel=ROUND_OFF, abs=ROUND_OFF) for s in first.shifts
        ]
        assert other.shifts[0].sigma == pytest.approx(first.shifts[0].sigma, rel=ROUND_OFF)
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
