# SPDX-License-Identifier: MIT
"""One log as CSV, MDF, MATLAB and Parquet: the same result to round-off."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.findings import render
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_log, read_raw
from drivetwin.logs.write import write_log
from drivetwin.vehicle.card import load_card
from tests.support.synth import synthesize

ROUND_OFF = 1e-9
"""Relative; the files hold the same doubles, and units are converted by one factor."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One log by format, with its card beside."""
    folder = tmp_path_factory.mktemp("formats")
    paths = {suffix: folder / f"log.{suffix}" for suffix in ("mf4", "csv", "mat", "parquet")}
    synthesize(paths["mf4"], "paper_steps", 4)
    channels = [
        RawChannel(one.name, one.unit, one.time, one.values)
        for one in read_raw(paths["mf4"]).channels
    ]
    for suffix in ("csv", "mat", "parquet"):
        write_log(paths[suffix], channels)
    return paths


def test_every_format_gives_the_same_channels(logs: dict[str, Path]) -> None:
    card = load_card(logs["mf4"].with_name("log.card.toml"))
    first, *others = (read_log(one, card) for one in logs.values())
    for other in others:
        assert render(other.findings) == render(first.findings)
        assert other.channels.keys() == first.channels.keys()
        for role, one in first.channels.items():
            two = other[role]
            assert two.held == one.held
            assert two.time == pytest.approx(one.time, rel=ROUND_OFF, abs=ROUND_OFF)
            assert two.values == pytest.approx(one.values, rel=ROUND_OFF, abs=ROUND_OFF)


def test_the_result_does_not_depend_on_the_format(
    logs: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """By the fast method, which uses every channel; the channels themselves are compared above."""
    card, results = str(logs["mf4"].with_name("log.card.toml")), []
    for name in ("csv", "mf4"):
        command = ["identify", str(logs[name]), "--vehicle", card, "--quick", "--json"]
        assert main(command) == 0
        results.append(json.loads(capsys.readouterr().out.replace(f"log.{name}", "log")))
    first, other = (list_numbers(one) for one in results)
    assert first.keys() == other.keys()
    assert len(first) > 200
    for place, value in first.items():
        rel = 1e-6 if place.startswith("fit") else ROUND_OFF
        assert other[place] == pytest.approx(value, rel=rel, abs=ROUND_OFF), place


def list_numbers(value: Any, place: str = "") -> dict[str, float]:
    """Numbers of a document by their place."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    found: dict[str, float] = {}
    for key, one in items:
        at = f"{place}.{key}".removeprefix(".")
        if isinstance(one, dict | list):
            found |= list_numbers(one, at)
        elif isinstance(one, float):
            found[at] = one
    return found
