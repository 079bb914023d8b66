# SPDX-License-Identifier: MIT
"""One synthetic log with card and truth for all tests of commands, and a quick calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.cli import main
from tests.calibration.cases import QUICK


@dataclass(frozen=True)
class Files:
    """Paths of a synthetic log and what belongs to it."""

    log: Path
    card: Path
    truth: Path


@pytest.fixture(scope="session")
def bench_files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    """Log, card and truth of the `paper_steps` scenario with its noise."""
    folder = tmp_path_factory.mktemp("bench")
    log = folder / "bench.csv"
    assert main(["synth", "-o", str(log), "--scenario", "paper_steps", "--seed", "1"]) == 0
    return Files(log, log.with_suffix(".card.toml"), log.with_suffix(".truth.json"))


@pytest.fixture(scope="module")
def quick_search() -> Iterator[None]:
    """Few candidates and draws in all calibrations of a file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CalibrationSettings, "scale_effort", lambda *_: QUICK)
        yield
