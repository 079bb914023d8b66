# SPDX-License-Identifier: MIT
"""The problem of the speed comparison: default settings reach the stated accuracy on it."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.network import simulate
from tests.support.upshift import reference
from tests.support.upshift.equations import Equations
from tests.support.upshift.scenario import Scenario, build_scenario
from tests.support.upshift.scipy_solution import solve
from tests.support.upshift.statement import Solution, make_inputs, make_problem


def _solution(scenario: Scenario) -> Solution:
    run = simulate(
        scenario.elements, scenario.inputs, scenario.start, scenario.time, scenario.outputs
    )
    assert run.status == "completed"
    columns = np.array([run.columns[output] for output in scenario.outputs])
    return Solution(columns, np.array([event.time for event in run.events]))


def _compare(found: Solution) -> tuple[float, float]:
    """Return the largest errors of T_o [N m] and of an event [s]."""
    expected = reference.read()
    torque = float(np.abs(found.columns[3] - expected.columns[3]).max())
    assert found.events.size == expected.events.size
    return torque, float(np.abs(found.events - expected.events).max())


@pytest.fixture(scope="module")
def stated() -> Scenario:
    return build_scenario(make_problem(), make_inputs())


def test_default_settings_reach_the_stated_accuracy(stated: Scenario) -> None:
    torque, events = _compare(_solution(stated))
    assert torque < 0.02
    assert events < 1e-7


def test_the_equations_of_the_peers_are_those_of_the_problem() -> None:
    given = make_inputs()
    found = solve(Equations(make_problem(), given), given.time, "LSODA", (1e-6, 1e-8, 1e-2))
    torque, events = _compare(found)
    assert torque < 2.0
    assert events < 1e-5
