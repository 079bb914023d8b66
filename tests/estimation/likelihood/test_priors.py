# SPDX-License-Identifier: MIT
"""Between what bounds the unknowns are sought."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.likelihood.optimize.multistart import fit_multistart
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import compute_parameters
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.simulation.variable import Variable
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, fitted, problem, truth_of

STEP = 1e-6


def _posed(known: dict[str, PriorValue]) -> tuple[ShiftObjective, ParameterVector]:
    made = bench()
    driveline = replace(made.driveline, known=known)
    loss_law = made.run.scenario.model.loss_law
    return build_problem([made.signals], [driveline], loss_law, truth_of(made))


def _first_gear() -> str:
    return bench().signals.shift.start_gear


def test_a_fixed_gear_inertia_is_met_exactly() -> None:
    known = {f"J_prime_{_first_gear()}": PriorValue(16.9)}
    problem, start = _posed(known)
    assert "J_e" not in start.names
    best = fit_multistart(problem, start, [bench().signals.shift])
    told = compute_parameters(best.problem, best.point, [bench().signals])
    assert told[f"J_prime_{_first_gear()}"] == pytest.approx(16.9, rel=1e-12)
    free = compute_parameters(fitted().problem, fitted().point, [bench().signals])
    assert told["eta"] != pytest.approx(free["eta"], rel=1e-4)


def test_the_core_is_told_how_a_tied_inertia_moves() -> None:
    problem, start = _posed({f"J_prime_{_first_gear()}": PriorValue(16.9)})
    structure = problem.terms[0].structure
    varied = structure.build_model(start.to_variables()).J1
    assert isinstance(varied, Variable)
    for unknown in ("J_out", "eta"):
        k = start.names.index(unknown)
        step = np.zeros_like(start.values)
        step[k] = STEP * start.values[k]
        models = [
            structure.build_model(start.replace_values(start.values + s)) for s in (step, -step)
        ]
        by_difference = (models[0].J1 - models[1].J1) / (2.0 * step[k])
        assert varied.slopes[k] == pytest.approx(by_difference, rel=1e-6)


def test_a_prior_on_a_gear_inertia_is_one_on_the_sum() -> None:
    gear, ratio = _first_gear(), bench().driveline.i_before
    known = {f"J_prime_{gear}": PriorValue(17.0, 0.1)}
    (with_sum, start), (without, _) = _posed(known), _posed({})
    J_e, J_out = start["J_e"], start["J_out"]
    for step in (0.0, 0.3, -0.2):
        values = start.values.copy()
        values[start.names.index("J_e")] = J_e + step
        difference = with_sum.prior.compute_prior_cost(values) - without.prior.compute_prior_cost(
            values
        )
        miss = (J_e + step + J_out / ratio**2 - 17.0) / 0.1
        if step == 0.0:
            offset = difference - miss**2
        assert difference - miss**2 == pytest.approx(offset, abs=1e-8 * max(1.0, miss**2))


@pytest.mark.parametrize("name", ["k_o", "eta", "te_delay", "J_vehicle"])
def test_what_is_fixed_is_no_unknown(name: str) -> None:
    problem, start = _posed({name: PriorValue(0.5)})
    assert name not in start.names
    assert problem.terms[0].structure.get_value(start, name) == 0.5


def test_two_fixed_gear_inertias_are_refused() -> None:
    shift = bench().signals.shift
    known = {f"J_prime_{g}": PriorValue(17.0) for g in (shift.start_gear, shift.end_gear)}
    with pytest.raises(InputError, match="one inertia"):
        _posed(known)


def test_a_prior_on_the_engine_inertia_is_one_on_its_share_of_je() -> None:
    made = bench()
    known = PriorValue(5.0, 0.1)
    driveline = replace(made.driveline, known={}, J1=known)
    guess = truth_of(made)
    posed, start = build_problem(
        [made.signals], [driveline], made.run.scenario.model.loss_law, guess
    )
    places = [start.names.index(name) for name in ("J_e", "eta")]
    free = replace(made, driveline=replace(made.driveline, known={}))
    added = posed.prior.precision - problem(free)[0].prior.precision
    assert np.count_nonzero(added) == 4
    eta = guess["eta"]
    change = np.array([5.0 * eta + 0.1 * eta, eta]) - posed.prior.mean[places]
    assert change @ added[np.ix_(places, places)] @ change == pytest.approx(1.0, rel=1e-6)
