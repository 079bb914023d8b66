# SPDX-License-Identifier: MIT
"""`drivetwin examine` prints and writes what it was asked."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.files.twin_file import load_twin
from tests.cli.conftest import Files


def test_suggestions_and_profile(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["examine", str(bench_files.log), "--vehicle", str(bench_files.card)]
    more = ["--profile", "eta", "--friction", "falling"]
    assert main([*arguments, *more, "-o", str(tmp_path / "asked")]) == 0
    printed = capsys.readouterr().out
    assert "Next recordings: each experiment was simulated" in printed
    assert "Profile likelihood of eta" in printed
    suggestions = json.loads((tmp_path / "asked" / "suggestions.json").read_text())
    for one in suggestions["suggestions"]:
        # No experiment narrows an interval that effects and sensors decide.
        assert one["experiments"] or "effects that the model leaves out" in one["text"]
    assert any(one["experiments"] for one in suggestions["suggestions"])
    profile = json.loads((tmp_path / "asked" / "profile.eta.json").read_text())
    low, high = profile["ci95_profile"]
    assert low < profile["estimate"] < high
    assert max(profile["rise"]) > 3.84
    friction = json.loads((tmp_path / "asked" / "friction.json").read_text())
    curve = friction["friction"]["B3"]
    assert load_twin(tmp_path / "asked" / "twin.toml").friction["B3"].mu.tolist() == curve["mu"]


def test_an_unknown_parameter_writes_nothing(
    bench_files: Files, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["examine", str(bench_files.log), "--vehicle", str(bench_files.card)]
    assert main([*arguments, "--profile", "nothing", "-o", str(tmp_path / "asked")]) == 2
    assert "unknown parameter id" in capsys.readouterr().err
    assert not (tmp_path / "asked").exists()
