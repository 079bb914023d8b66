# SPDX-License-Identifier: MIT
"""The problem of the speed comparison: default settings reach the stated accuracy on it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.speed import reference
from benchmarks.speed.core import Scenario
from benchmarks.speed.equations import Equations
from benchmarks.speed.general import with_brakes, with_shafts
from benchmarks.speed.measure import Quality
from benchmarks.speed.scipy_peer import solve
from benchmarks.speed.shift import judge, scenario_of
from benchmarks.speed.statement import Solution, inputs, problem
from drivetwin.network import simulate


def _solution(scenario: Scenario) -> Solution:
    run = simulate(
        scenario.elements, scenario.inputs, scenario.start, scenario.time, scenario.outputs
    )
    assert run.status == "completed"
    columns = np.array([run.columns[output] for output in scenario.outputs])
    return Solution(columns, np.array([event.time for event in run.events]))


def _quality(found: Solution) -> Quality:
    quality = judge(reference.read())(found)
    assert quality is not None
    return quality


@pytest.fixture(scope="module")
def stated() -> Scenario:
    return scenario_of(problem(), inputs())


def test_default_settings_reach_the_stated_accuracy(stated: Scenario) -> None:
    quality = _quality(_solution(stated))
    assert quality.error < 0.02
    assert quality.events is not None
    assert quality.events < 1e-7


def test_the_equations_of_the_peers_are_those_of_the_problem() -> None:
    given = inputs()
    found = solve(Equations(problem(), given), given.time, "LSODA", (1e-6, 1e-8, 1e-2))
    quality = _quality(found)
    assert quality.error < 2.0
    assert quality.events is not None
    assert quality.events < 1e-5


def test_larger_drivelines_start_as_the_shift(stated: Scenario) -> None:
    plain = _solution(stated)
    for wide in (with_shafts(stated, 2), with_brakes(stated, 2)):
        found = _solution(wide)
        assert found.columns[:, 0] == pytest.approx(plain.columns[:, 0])
        assert np.abs(found.columns[3] - plain.columns[3]).max() > 1.0
