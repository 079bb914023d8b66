# SPDX-License-Identifier: MIT
"""The core: timed inside Rust by the example `one_shift`, and through Python."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np

from benchmarks.speed.measure import Sample
from tests.support.upshift.scenario import Scenario
from tests.support.upshift.statement import Solution

ROOT = Path(__file__).resolve().parents[2]
_EXAMPLE = "one_shift"
_WARMING = 50
"""Runs of a process before those that count: the other programs are warm as well."""


class Example:
    """The compiled example."""

    def __init__(self, folder: Path, *, build: bool) -> None:
        """Build it, or take the one that is there. Scenarios are stored in `folder`.

        Raises CalledProcessError, FileNotFoundError.
        """
        self.folder = folder
        target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
        self.path = target / "release" / "examples" / _EXAMPLE
        if build:
            command = ["cargo", "build", "--release", "-p", "drivetwin-core", "--example", _EXAMPLE]
            subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        if not self.path.exists():
            raise FileNotFoundError(self.path)

    def store(self, name: str, scenario: Scenario) -> Path:
        """Write a scenario to a file."""
        path = self.folder / f"{name}.json"
        path.write_text(scenario.write_json(), encoding="utf-8")
        return path

    def run(self, scenario: Path, repeats: int, which: str) -> Sample:
        """Run a scenario; return seconds of `which` (`again`, `first`, `whole`) and solution."""
        command = [str(self.path), str(scenario), str(_WARMING + repeats)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        result = json.loads(done.stdout)
        if result["status"] != "completed":
            raise RuntimeError(f"{scenario.name}: {result['status']}")
        solution = Solution(np.array(result["columns"]), np.array(result["events"]))
        return Sample(result[which][_WARMING:], solution)
