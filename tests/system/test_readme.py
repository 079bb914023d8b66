# SPDX-License-Identifier: MIT
"""The README's example runs as printed, and its table names the commands there are."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import typer

from drivetwin.cli import app, main

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_runs_as_printed(tmp_path: Path) -> None:
    (example,) = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    assert main(["synth", "-o", str(tmp_path / "shift.csv")]) == 0
    done = subprocess.run(
        [sys.executable, "-c", example], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"^eta 0\.8\d+ \(.*\) 1 identified$", done.stdout, re.MULTILINE)
    assert "fit_percent" in done.stdout


def test_the_table_names_the_commands() -> None:
    named = re.findall(r"^\| `drivetwin (\w+)` \|", README, re.MULTILINE)
    click_app = typer.main.get_command(app)
    assert named == list(getattr(click_app, "commands", {}))
