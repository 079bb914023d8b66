# SPDX-License-Identifier: MIT
"""`drivetwin demo`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main


def test_demo_compares_both_methods_with_the_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "-o", str(out)]) == 0
    text = capsys.readouterr().out
    report = out / "integral" / "report.html"
    assert f"report: {report}" in text
    assert report.is_file()
    for word in ("truth", "paper", "integral", "J_prime_2", "mu.B3 @30"):
        assert word in text
    table = text.partition("± is")[0]
    assert max(len(line) for line in table.splitlines()) <= 80


def test_demo_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", "-o", str(tmp_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    rows = {row["id"]: row for row in document["parameters"]}
    assert rows["J_vehicle"]["truth"] == 6056.0
    assert rows["J_vehicle"]["integral"]["value"] == pytest.approx(6056.0, rel=0.03)
    assert Path(document["report"]).is_file()
