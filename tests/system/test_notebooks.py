# SPDX-License-Identifier: MIT
"""The example notebooks run from the first cell to the last, and leave what they promise."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from tests.support.repeats import mark_repeats

NOTEBOOKS = Path(__file__).resolve().parents[2] / "examples" / "notebooks"
LEAVES = {
    "identify_a_shift": {"report.html", "result.json", "twin.toml"},
    "compare_two_logs": {"comparison.html"},
    "what_if": {"shift.csv"},
    "fit_a_driveline": {"report.html", "tip_in.csv"},
}


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in NOTEBOOKS.glob("*.py")} == set(LEAVES)


@pytest.mark.parametrize(
    "name", mark_repeats(LEAVES, LEAVES.keys() - {"identify_a_shift"}, pytest.mark.howto)
)
def test_a_notebook_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = NOTEBOOKS / f"{name}.py"
    assert len(re.findall(r"^# %%", path.read_text(encoding="utf-8"), re.M)) >= 4
    runpy.run_path(str(path), run_name="__main__")
    assert LEAVES[name] <= {file.name for file in tmp_path.iterdir()}
