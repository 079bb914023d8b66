# SPDX-License-Identifier: MIT
"""Plants with a part beside the dual clutch: limits and derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.plant_refit import (
    build_plant_priors,
    extend_problem,
)
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, problem

RIGID = {
    EffectId.INPUT_SHAFT_MODE: 2e4,
    EffectId.BACKLASH: 1e-9,
}
"""Sizes at which a part hardly acts."""


def _state(effect: EffectId) -> tuple[PriorValue, ...]:
    """Priors of the unknowns of a part that hardly acts."""
    stated = EffectPriors({effect: EffectPrior(0.0, RIGID[effect])})
    return build_plant_priors(effect, stated, bench().driveline)


@pytest.mark.parametrize("effect", RIGID)
def test_a_rigid_part_leaves_the_dual_clutch(effect: EffectId) -> None:
    posed, start = problem(bench())
    extended, point = extend_problem(posed, start, effect, _state(effect))
    plain, found = posed.parts[0].simulate(start), extended.parts[0].simulate(point)
    assert plain is not None
    assert found is not None
    largest = np.max(np.abs(plain.shaft_torque))
    assert found.shaft_torque == pytest.approx(plain.shaft_torque, abs=2e-4 * largest)
    assert found.engine_speed == pytest.approx(plain.engine_speed, rel=1e-4)


def test_the_derivatives_of_a_rigid_part_are_those_of_the_dual_clutch() -> None:
    """The differences of the network against the sensitivities of the core."""
    posed, start = problem(bench())
    effect = EffectId.INPUT_SHAFT_MODE
    extended, point = extend_problem(posed, start, effect, _state(effect))
    plain, found = posed.parts[0].linearise(start), extended.parts[0].linearise(point)
    assert plain is not None
    assert found is not None
    sigma = posed.parts[0].record.sigma[:, None]
    exact = plain[1] / sigma
    differenced = found[1][:, : exact.shape[1]] / sigma
    miss = np.linalg.norm(differenced - exact, axis=0)
    assert np.all(miss <= 0.02 * np.linalg.norm(exact, axis=0))


@pytest.mark.parametrize("effect", RIGID)
def test_a_dropped_part_gives_the_problem_again(effect: EffectId) -> None:
    posed, start = problem(bench())
    extended, _ = extend_problem(posed, start, effect, _state(effect))
    assert extended.drop_extension().cost(start) == posed.cost(start)
