# SPDX-License-Identifier: MIT
"""`drivetwin drive`."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main


def test_writes_page_and_traces_and_tells_every_shift(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["drive", "simpson-3", "--course", "launch", "-o", str(tmp_path / "out")]) == 0
    text = capsys.readouterr().out
    assert "1→2" in text
    assert "2→3" in text
    assert "unexplained" in text
    assert max(len(line) for line in text.splitlines()) <= max(80, len(str(tmp_path)) + 40)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"drive.html", "drive.csv"}
    page = (tmp_path / "out" / "drive.html").read_text(encoding="utf-8")
    assert not re.findall(r'(?:src|href)="https?:', page)
    # The drive, its two shifts, the energy.
    assert page.count("<figure>") == 3
    # Works of engine and road, heats, and gains of stored energy close on every row.
    names, _, *rows = (tmp_path / "out" / "drive.csv").read_text(encoding="utf-8").splitlines()
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    columns = dict(zip(names.split(","), table.T, strict=True))
    parts = [one for name, one in columns.items() if name.startswith(("work.", "heat."))]
    parts += [one - one[0] for name, one in columns.items() if name.startswith("energy.")]
    assert np.abs(np.sum(parts, axis=0)).max() < 1e-8 * max(np.abs(one).max() for one in parts)
    taken = columns["pump_torque"] * columns["engine_speed"]
    given = columns["turbine_torque"] * columns["input_speed"]
    assert (taken - given).min() > -1e-6 * np.abs(taken).max()


def test_json_carries_shifts_and_energy(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", "simpson-3", "--course", "launch", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [each["label"] for each in document["shifts"]] == ["1→2", "lock-up", "2→3"]
    assert document["powertrain"] == "Car, 350 N m"
    assert abs(document["energy"]["error"]) < 1e-6 * document["energy"]["source"]


def test_what_cannot_be_driven_is_an_error_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["drive", "truck", "-o", str(tmp_path / "out")]) == 2
    assert "truck" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_manual_gearbox_shows_dogs_and_starting_clutch(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    assert main(["drive", "manual-6", "--course", "launch", "-o", str(folder)]) == 0
    text = capsys.readouterr().out
    for word in ("launch", "1→2", "D1→D2", "dogs", "5→6"):
        assert word in text
    assert "torque converter" not in text
    names = (folder / "drive.csv").read_text().partition("\n")[0].split(",")
    assert "speed.input shaft" in names
    assert "pressure.D1" not in names
