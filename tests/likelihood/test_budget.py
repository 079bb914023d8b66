# SPDX-License-Identifier: MIT
"""The work of a search is counted in passes over the log, not in seconds."""

from __future__ import annotations

import pytest

from drivetwin.errors import IdentificationError
from drivetwin.likelihood.budget import limit_evaluations
from tests.estimation.likelihood.fixtures import bench, problem


def test_runs_and_expansions_are_work_within_the_block_alone() -> None:
    posed, start = problem(bench())
    with limit_evaluations(10.0) as meter:
        posed.cost(start)
        posed.normal(start)
        assert meter.left == 1.0
        posed.cost(start)
        with pytest.raises(IdentificationError, match="did not converge within"):
            posed.cost(start)
    posed.cost(start)
