# SPDX-License-Identifier: MIT
"""`drivetwin demo`."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.cli import main

DEFAULT_METHOD = "likelihood"


def test_demo_compares_both_methods_with_the_truth(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert main(["demo", "-o", str(out)]) == 0
    text = capsys.readouterr().out
    report = out / DEFAULT_METHOD / "report.html"
    assert f"report: {report}" in text
    assert report.is_file()
    for word in ("truth", "paper", DEFAULT_METHOD, "J_prime_2", "mu.B3 @30"):
        assert word in text
    table = text.partition("± is")[0]
    assert max(len(line) for line in table.splitlines()) <= 80
