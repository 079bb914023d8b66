# SPDX-License-Identifier: MIT
"""Synthetic logs as `drivetwin synth` writes them."""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from drivetwin.cli import main


def synthesize(
    path: Path, scenario: str, seed: int = 0, noise: float = 1.0
) -> tuple[Path, Path, Path]:
    """Write a run of a scenario; return log, vehicle card and truth."""
    options = ["--scenario", scenario, "--seed", str(seed), "--noise", str(noise)]
    with redirect_stdout(StringIO()):
        assert main(["synth", "-o", str(path), *options]) == 0
    return path, path.with_suffix(".card.toml"), path.with_suffix(".truth.json")
