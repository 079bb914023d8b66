# SPDX-License-Identifier: MIT
"""Joint estimates of a store of known truth: ageing, units, outliers with the reason."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.fleet.estimate import estimate_fleet
from tests.fleet.toys import fill, open_store

UNITS, LOGS = 15, 30
DRIFT = -4e-5
DESIGN = Verdict.DESIGN.value
STRAY = "00000123"


def _value_row(name: str, value: float, std: float, **more: float) -> tuple[Any, ...]:
    return ("parameter", name, value, std, std, {"verdict": "identified", **more})


def _rows(mu: float, log: str, draws: np.random.Generator) -> list[tuple[Any, ...]]:
    fit = 60.0 if log == STRAY else 95.0 + draws.normal()
    return [
        _value_row("mu.B3", mu, 1e-3),
        _value_row("eta", 0.85 + 1e-3 * draws.normal(), 1e-3),
        _value_row("P0.B3", 8e4, 0.0, free_value=8.2e4 + 1e3 * draws.normal(), free_std=1e3),
        ("parameter", "P0.B2", 8e4, 0.0, 0.0, {"verdict": DESIGN}),
        ("fit", "output_torque.all.fit_percent", fit, {}),
        ("field", "oil_degC", 80.0 + 5.0 * draws.normal(), {}),
        *([("warning", "", {"reason": "the sensor sticks"})] if log == STRAY else []),
    ]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A fleet in which one unit is odd, and one log is stray."""
    draws = np.random.default_rng(0)
    level = 0.118 + 2e-3 * draws.standard_normal(UNITS)
    level[4] += 0.05
    with open_store(tmp_path_factory.mktemp("fleet")) as opened:
        for number in range(UNITS * LOGS):
            log, unit = f"{number:08d}", number % UNITS
            reading = 200.0 * draws.random()
            mu = level[unit] + DRIFT * (reading - 100.0) + 1e-3 * draws.normal()
            mu += 0.02 if log == STRAY else 0.0
            file: dict[str, Any] = {"path": f"/l/{log}.csv", "rule": "trucks", "unit": f"T{unit}"}
            fill(opened, log, _rows(mu, log, draws), **file, fields={"odometer": reading})
        opened.compact()
        yield opened


@pytest.fixture(scope="module")
def found(store: Any) -> dict[str, Any]:
    """All joint estimates, by parameter."""
    return {one.parameter: one for one in estimate_fleet(store)}


def test_only_what_logs_tell_is_estimated(found: dict[str, Any]) -> None:
    assert set(found) == {"mu.B3", "eta", "P0.B3"}
    assert {one.rule for one in found.values()} == {"trucks"}


def test_drift_and_level_are_within_their_intervals(found: dict[str, Any]) -> None:
    mu = found["mu.B3"]
    drift = mu.drifts[0]
    assert drift.field == "odometer"
    assert drift.ci95[0] < DRIFT < drift.ci95[1]
    assert drift.ci95[1] < 0.0
    oil = mu.drifts[1]
    assert oil.field == "oil_degC"
    assert oil.ci95[0] < 0.0 < oil.ci95[1]
    eta = found["eta"]
    assert eta.ci95[0] < 0.85 < eta.ci95[1]
    assert eta.spread_ci95 is not None
    assert eta.spread_ci95[0] == 0.0


def test_the_cards_design_value_does_not_count(found: dict[str, Any]) -> None:
    P0 = found["P0.B3"]
    assert P0.ci95[0] < 8.2e4 < P0.ci95[1]
    assert P0.ci95[0] > 8.05e4


def test_a_unit_beyond_the_others_is_odd(found: dict[str, Any]) -> None:
    assert [unit.unit for unit in found["mu.B3"].units if unit.odd] == ["T4"]
    assert not any(unit.odd for unit in found["eta"].units)


def test_an_odd_unit_is_told_by_the_command(
    store: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fleet", "estimate", str(store.folder), "--parameter", "mu.B3"]) == 0
    reported = " ".join(capsys.readouterr().out.split())
    assert "Units beyond what chance makes. They count in shared value and spread." in reported
    assert "T4 μ (B3) 0.04" in reported
    page = tmp_path / "page.html"
    assert main(["fleet", "report", str(store.folder), "-o", str(page)]) == 0
    text = page.read_text("utf-8")
    assert f"<h1>Fleet of {UNITS} units</h1>" in text
    assert re.search(r"drifts by −[\d.]+ % between [\d.]+ and [\d.]+ odometer", text)


def test_a_stray_log_is_named_with_the_reason(found: dict[str, Any]) -> None:
    (outlier,) = found["mu.B3"].outliers
    assert outlier.log == STRAY
    assert outlier.score > 8.0
    assert "above the value expected for unit T3" in outlier.reason
    for words in ("fits its output torque to 60.0 %", "the sensor sticks"):
        assert words in outlier.reason
    assert not found["eta"].outliers


def test_too_few_logs_give_no_estimate(tmp_path: Path) -> None:
    with open_store(tmp_path) as opened:
        for log in ("00", "01"):
            fill(opened, log, [_value_row("eta", 0.8, 0.1)], unit="u", rule="r")
        assert estimate_fleet(opened) == []
