# SPDX-License-Identifier: MIT
"""One synthetic log with card and truth for all tests of commands, and a quick calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from drivetwin.calibration.settings import CalibrationSettings
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
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
    return Files(*write_run(folder / "bench.csv", run(load_scenario("paper_steps"), seed=1)))


@pytest.fixture(scope="module")
def quick_search() -> Iterator[None]:
    """Few candidates and draws in all calibrations of a file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CalibrationSettings, "for_policy", lambda _: QUICK)
        yield
