# SPDX-License-Identifier: MIT
"""Plants with a part beside the dual clutch: limits and derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.selection.plants import (
    build_plant_priors,
    extend_problem,
)
from drivetwin.estimation.likelihood.shift_objective import ShiftTerm
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, problem
from tests.support.arrays import FloatArray

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
    plain, found = posed.terms[0].simulate(start), extended.terms[0].simulate(point)
    assert plain is not None
    assert found is not None
    largest = np.max(np.abs(plain.shaft_torque))
    assert found.shaft_torque == pytest.approx(plain.shaft_torque, abs=2e-4 * largest)
    assert found.engine_speed == pytest.approx(plain.engine_speed, rel=1e-4)


SIZES = {
    EffectId.INPUT_SHAFT_MODE: 60.0,
    EffectId.BACKLASH: 0.03,
    EffectId.TYRE_SLIP: 2e-3,
    EffectId.PROGRESSIVE_SHAFT: -0.05,
}
"""Usual sizes."""


@pytest.mark.parametrize("effect", SIZES)
def test_derivatives_by_all_unknowns_are_exact(effect: EffectId) -> None:
    """Compare with differences of runs, the unknowns of the engine torque left out."""
    posed, start = problem(bench())
    stated = EffectPriors({effect: EffectPrior(0.0, SIZES[effect])})
    priors = build_plant_priors(effect, stated, bench().driveline)
    extended, point = extend_problem(posed, start, effect, priors)
    term = extended.terms[0]
    found = term.linearise(point)
    assert found is not None
    residual, slopes = found
    assert residual.shape == (len(slopes),)
    for k, name in enumerate(point.names):
        if name in ("te_delay", "te_offset"):
            continue
        size = float(np.linalg.norm(slopes[:, k] / term.record.sigma))
        step = 0.3 / size if size else 1e-3
        whole, half = (_difference(term, point, k, one) for one in (step, 0.5 * step))
        miss = np.linalg.norm(((4.0 * half - whole) / 3.0 - slopes[:, k]) / term.record.sigma)
        # A lock that moves over a sample, and the points of a table, differ by less than 1 %. Play
        # that the torque does not cross does not act.
        assert size > 0.0 or effect is EffectId.BACKLASH, name
        assert miss <= 0.01 * size + 1e-6, name


def _difference(term: ShiftTerm, point: ParameterVector, index: int, step: float) -> FloatArray:
    """Compute the central difference (n,) of the simulated samples by one unknown."""
    change = np.zeros_like(point.values)
    change[index] = step
    runs = [term.simulate(point.replace_values(point.values + one)) for one in (change, -change)]
    ahead, behind = (term.compute_residual(one) for one in runs if one is not None)
    return np.asarray((behind - ahead) / (2.0 * step))


@pytest.mark.parametrize("effect", RIGID)
def test_a_dropped_part_gives_the_problem_again(effect: EffectId) -> None:
    posed, start = problem(bench())
    extended, _ = extend_problem(posed, start, effect, _state(effect))
    assert extended.drop_plant_effect().cost(start) == posed.cost(start)
