# SPDX-License-Identifier: MIT
"""`drivetwin synth`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main


def test_writes_log_card_and_truth_and_nothing_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "run.csv"
    assert main(["synth", "-o", str(log), "--scenario", "paper", "--json"]) == 0
    captured = capsys.readouterr()
    named = json.loads(captured.out)
    assert {Path(path).name for path in named.values()} == {
        path.name for path in tmp_path.iterdir()
    }
    assert named["log"] == str(log)
    assert log.read_text().startswith("time,EngTrq,")


def test_same_arguments_write_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        assert main(["synth", "-o", str(tmp_path / name / "x.csv"), "--seed", "5"]) == 0
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


@pytest.mark.parametrize("option", [("--noise", "-1"), ("--torque-reduction", "1.5")])
def test_impossible_options_leave_nothing(
    option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["synth", "-o", str(tmp_path / "out" / "x.csv"), *option]) == 2
    assert "->" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
