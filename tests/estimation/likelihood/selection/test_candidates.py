# SPDX-License-Identifier: MIT
"""Terms of the load by evidence; minima about the P0 of an element that lingers there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.dyno.actuators import Program
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import MULTI_START, fit_local
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.candidates import (
    try_minima,
)
from drivetwin.estimation.likelihood.selection.select_model import select_model
from tests.estimation.likelihood.fixtures import truth_of
from tests.support.bench import Bench, Knowledge, record_bench

ROUGH = Knowledge(J_out=0.1, P0=5e3)
PRESSURE = "B2.P0"
NAMES = ("Tv_over_if", "J_vehicle", "start1.load", "start2.load")


def _lingering(above: float) -> Scenario:
    """`paper_steps` with the off-going element held so far `above` its P0 [Pa] while it slips."""
    base = load_scenario("paper_steps")
    (one, _), actuator = base.model.elements, base.actuators["B2"]
    held = one.P0 + above
    knots = tuple((time, max(value, held)) for time, value in actuator.command.knots)
    command = Program((*knots, (2.75, held), (2.80, 0.0)))
    return replace(base, actuators={**base.actuators, "B2": replace(actuator, command=command)})


def _deviation(fit: LikelihoodFit, made: Bench) -> float:
    k = fit.point.names.index(PRESSURE)
    miss = fit.mean.values[k] - truth_of(made)[PRESSURE]
    return float(miss / np.sqrt(fit.covariance[k, k]))


def test_five_kilopascals_above_p0_noise_does_not_end_the_search() -> None:
    made = record_bench(_lingering(5e3), 1, ROUGH)
    design = {f"{one.name}.P0": one.P0.value for one in made.driveline.couplings.values()}
    guess = truth_of(made) | design
    fit, _ = select_model(
        [made.signals], [made.driveline], made.run.scenario.model.loss_law, guess, EffectPriors()
    )
    assert fit.chi2 < MULTI_START.accept_chi2
    assert abs(_deviation(fit, made)) < 3.0


def test_the_lower_of_two_minima_about_p0_is_taken() -> None:
    made = record_bench(_lingering(2e3), 2, ROUGH)
    truth = truth_of(made)
    law = made.run.scenario.model.loss_law
    guess = truth | {PRESSURE: truth[PRESSURE] + 12e3}
    problem, start = build_problem([made.signals], [made.driveline], law, guess)
    one = fit_local(problem, start)
    assert one is not None
    other = try_minima(one, problem)
    assert other.normal.cost < one.normal.cost - 10.0
    assert abs(_deviation(other, made)) < abs(_deviation(one, made))
