# SPDX-License-Identifier: MIT
"""Progress of recorded runs: the share shown follows the time, and the time left is about right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.progress import SCENARIOS, Timeline, make_bench, record_timeline
from drivetwin.estimation.result.method import Method
from tests.support.repeats import mark_repeats

QUIET = 1.0
"""Time from which a run shows its progress [s]."""
DEVIATION = 0.2
"""Largest deviation of the share shown from the share of the CPU time gone."""


@pytest.mark.parametrize("scenario", mark_repeats(["paper_steps", "gearbox"], ["paper_steps"]))
def test_an_identification_shows_its_share_of_the_time(tmp_path: Path, scenario: str) -> None:
    assert scenario in SCENARIOS
    bench = make_bench(tmp_path, scenario, seed=3)  # the table was measured with other noise
    line = record_timeline(lambda: bench.identify(Method.LIKELIHOOD))
    assert line.whole > 1.0
    assert line.deviation < DEVIATION
    shown, right = line.count_right(factor=2.0)
    # No time left is shown while the run is quiet, a second, and at the start of its share.
    assert shown > 0.85 - QUIET / (0.95 * line.whole)
    assert right > 0.85


def test_a_share_that_runs_ahead_is_found() -> None:
    """90 % after a third of the time, as the shares by hand had it."""
    ahead = Timeline(np.array([0.5, 3.0, 9.0]), np.array([0.5, 0.9, 1.0]), 9.0)
    assert ahead.deviation > 0.5
    shown, right = ahead.count_right()
    assert shown * right < 0.3
