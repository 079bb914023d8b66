# SPDX-License-Identifier: MIT
"""`drivetwin synth`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card


def test_same_arguments_write_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert main(["synth", "-o", str(tmp_path / name / "x.csv"), "--seed", "5"]) == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


@pytest.mark.parametrize(
    "option",
    [
        ("--noise", "-1"),
        ("--torque-reduction", "1.5"),
        ("--drum", "0.1"),
        ("--effect", "tyre_slip=-0.1"),
        ("--effect", "slip=0.1"),
    ],
)
def test_impossible_options_leave_nothing(
    option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["synth", "-o", str(tmp_path / "out" / "x.csv"), *option]) == 2
    assert "->" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("suffix", "library"), [(".mat", "scipy"), (".mf4", "asammdf"), (".parquet", "pyarrow")]
)
def test_other_formats_hold_the_same_channels(suffix: str, library: str, tmp_path: Path) -> None:
    pytest.importorskip(library)
    logs = []
    for name in ("run.csv", f"other{suffix}"):
        path = tmp_path / name
        assert main(["synth", "-o", str(path), "--scenario", "gearbox_chain"]) == 0
        card = load_card(path.with_suffix(".card.toml"))
        logs.append((read_log(path, card), detect_shifts(read_log(path, card), card)))
    (table, _), (other, found) = logs
    assert [(s.start_gear, s.end_gear) for s in found.shifts] == [("2", "3"), ("3", "4")]
    assert set(table.channels) == set(other.channels)
    speed = table["input_speed"]
    at = np.searchsorted(other["input_speed"].time, 3.0)
    expected = np.interp(other["input_speed"].time[at], speed.time, speed.values)
    assert other["input_speed"].values[at] == pytest.approx(expected, abs=1e-5)


def test_truth_tells_every_shift_and_the_plant(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    assert main(["synth", "-o", str(path), "--scenario", "gearbox_chain", "--drum", "0.08"]) == 0
    truth = json.loads(path.with_suffix(".truth.json").read_text(encoding="utf-8"))
    assert [shift["end_gear"] for shift in truth["shifts"]] == ["3", "4"]
    assert truth["run"]["plant"].startswith("Three-set")
    card = load_card(path.with_suffix(".card.toml"))
    assert card.elements["C4"].drum_inertia.value == 0.08
    assert card.elements["C2"].kind == "clutch"


def test_an_unknown_format_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["synth", "-o", str(tmp_path / "out" / "x.xlsx")]) == 2
    assert ".parquet" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_effects_change_the_log_and_are_listed_in_the_truth(tmp_path: Path) -> None:
    plain, departing = tmp_path / "plain.csv", tmp_path / "departing.csv"
    assert main(["synth", "-o", str(plain)]) == 0
    chosen = ["--effect", "tyre_slip=0.004", "--effect", "input_drag=0.01"]
    assert main(["synth", "-o", str(departing), *chosen]) == 0
    assert plain.read_bytes() != departing.read_bytes()
    cards = [path.with_suffix(".card.toml").read_bytes() for path in (plain, departing)]
    assert cards[0] == cards[1]
    truths = [
        json.loads(path.with_suffix(".truth.json").read_text(encoding="utf-8"))
        for path in (plain, departing)
    ]
    assert truths[0]["effects"] == {}
    assert truths[1]["effects"] == {"tyre_slip": 0.004, "input_drag": 0.01}
    assert truths[0]["parameters"] == truths[1]["parameters"]
