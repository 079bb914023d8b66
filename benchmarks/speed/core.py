# SPDX-License-Identifier: MIT
"""The core: timed inside Rust by the example `one_shift`, and through Python."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.measure import Sample
from benchmarks.speed.statement import Solution
from drivetwin.driveline import FloatArray, Signal
from drivetwin.network import Element, Output, Sine, Start

ROOT = Path(__file__).resolve().parents[2]
RUN, BATCH = "one_shift", "time_batch"
"""The examples of the core that are timed."""


@dataclass(frozen=True)
class Scenario:
    """A run of a network; the first outputs are the columns of its solution."""

    elements: Sequence[Element]
    inputs: Mapping[str, Signal | Sine]
    start: Start
    time: FloatArray
    outputs: Sequence[Output]

    def as_json(self) -> str:
        """As the example reads it."""
        samples = {
            name: [one.time.tolist(), one.values.tolist()]
            for name, one in self.inputs.items()
            if isinstance(one, Signal)
        }
        sines = {
            name: [one.offset, one.amplitude, one.frequency, one.phase]
            for name, one in self.inputs.items()
            if isinstance(one, Sine)
        }
        document: dict[str, Any] = {
            "elements": list(self.elements),
            "time": self.time.tolist(),
            "samples": samples,
            "sines": sines,
            "speeds": list(self.start.speeds.items()),
            "twists": list(self.start.twists.items()),
            "locked": list(self.start.locked),
            "outputs": [{kind: name} for kind, name in self.outputs],
        }
        return json.dumps(document)


class Examples:
    """The compiled examples."""

    def __init__(self, folder: Path, *, build: bool) -> None:
        """Build them, or take those that are there. Scenarios are stored in `folder`.

        Raises CalledProcessError, FileNotFoundError.
        """
        self.folder = folder
        target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
        self._programs = target / "release" / "examples"
        if build:
            command = ["cargo", "build", "--release", "-p", "drivetwin-core"]
            command += [part for name in (RUN, BATCH) for part in ("--example", name)]
            subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
        for name in (RUN, BATCH):
            if not self.path(name).exists():
                raise FileNotFoundError(self.path(name))

    def path(self, name: str) -> Path:
        """Program of an example."""
        return self._programs / name

    def store(self, name: str, scenario: Scenario) -> Path:
        """Scenario as a file."""
        return self.store_text(name, scenario.as_json())

    def store_text(self, name: str, text: str) -> Path:
        """Any JSON as a file."""
        path = self.folder / f"{name}.json"
        path.write_text(text, encoding="utf-8")
        return path

    def run(self, scenario: Path, repeats: int, which: str) -> Sample:
        """Seconds of `which` (`prepared` or `whole`) runs, and the solution."""
        result = self.call(RUN, str(scenario), str(repeats))
        if result["status"] != "completed":
            raise RuntimeError(f"{scenario.name}: {result['status']}")
        solution = Solution(np.array(result["columns"]), np.array(result["events"]))
        return Sample(result[which], solution)

    def call(self, name: str, *arguments: str) -> dict[str, Any]:
        """What an example prints."""
        command = [str(self.path(name)), *arguments]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        result: dict[str, Any] = json.loads(done.stdout)
        return result
