# SPDX-License-Identifier: MIT
"""Choice of the plant by logs with a mode of the input side, and without."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_multistart
from drivetwin.estimation.likelihood.parametrization import PLANTS
from drivetwin.estimation.likelihood.selection.candidates import try_plants
from drivetwin.estimation.result.cause import LEAD
from drivetwin.findings import Code
from drivetwin.vehicle.effects import EffectId
from tests.estimation.likelihood.fixtures import ROUGH, fitted, problem
from tests.support.bench import Bench, record_bench
from tests.support.shared_results import shared

MODE = EffectId.INPUT_SHAFT_MODE
FREQUENCY = 29.0


@shared
def swinging() -> tuple[Bench, LikelihoodFit]:
    """A vehicle whose engine swings on the input shaft, and its fit by the dual clutch."""
    scenario = load_scenario(ScenarioName.THROTTLE_STEPS)
    made = record_bench(scenario, 0, ROUGH, effects={MODE: FREQUENCY})
    posed, start = problem(made)
    return made, fit_multistart(posed, start, [made.signals.shift])


def _count_deviations(fit: LikelihoodFit, name: str, truth: float) -> float:
    std = np.sqrt(fit.covariance[fit.point.names.index(name), fit.point.names.index(name)])
    return float(abs(fit.mean[name] - truth) / std)


def test_a_mode_of_the_input_side_is_found_and_the_stiffness_is_true() -> None:
    made, plain = swinging()
    found = try_plants(plain, EffectPriors())
    assert found.plant is not None
    assert found.plant.effect is MODE
    assert found.plant.nats > LEAD
    index = found.plant.index
    std = np.sqrt(found.covariance[index, index])
    assert abs(found.point.values[index] - np.log(FREQUENCY)) < 3.0 * std
    assert std < 0.25
    truth = made.run.scenario.model.k_o
    assert _count_deviations(plain, "k_o", truth) > 4.0
    assert _count_deviations(found, "k_o", truth) < 3.0


def test_a_part_of_the_plant_is_named_and_reported_as_parameters() -> None:
    made, plain = swinging()
    found = build_estimates(
        try_plants(plain, EffectPriors()), [made.signals], [made.driveline], {}, EffectPriors()
    )
    assert found.cause is not None
    assert found.cause.in_plant
    assert Code.EFFECT_IN_PLANT in [one.code for one in found.findings]
    frequency = found.estimates["mode_frequency"]
    assert frequency.value is not None
    assert frequency.std_total is not None
    assert abs(frequency.value - FREQUENCY) < 3.0 * frequency.std_total
    share = found.estimates["mode_share"]
    assert share.std_total is not None
    assert share.std_total < PLANTS[MODE].shape["share"].std


def test_a_log_without_a_mode_keeps_the_dual_clutch_and_widens() -> None:
    plain = fitted()
    found = try_plants(plain, EffectPriors())
    assert found.plant is None
    assert np.array_equal(found.point.values, plain.point.values)
    std = np.sqrt(np.diag(plain.covariance))
    added = (found.covariance - plain.covariance) / np.outer(std, std)
    assert np.linalg.eigvalsh(added)[0] > -1e-9
    assert np.max(added) > 0.0


TYRE = EffectId.TYRE_SLIP


@shared
def slipping() -> tuple[Bench, LikelihoodFit]:
    """A vehicle whose tyres slip by 0.6 %, and its fit by the dual clutch."""
    scenario = load_scenario(ScenarioName.THROTTLE_STEPS)
    made = record_bench(scenario, 0, ROUGH, effects={TYRE: 6e-3})
    posed, start = problem(made)
    return made, fit_multistart(posed, start, [made.signals.shift])


def test_a_large_slip_of_the_tyres_is_estimated_in_the_plant() -> None:
    """Its column at the minimum of the dual clutch leaves a fifth of the noise."""
    made, plain = slipping()
    found = try_plants(plain, EffectPriors())
    assert plain.chi2 > 1.15
    assert found.chi2 < 1.02
    assert found.plant is not None
    assert found.plant.effect is TYRE
    size, std = np.exp(found.point.values[-1]), np.sqrt(found.covariance[-1, -1])
    assert size == pytest.approx(6e-3, rel=max(3.0 * std, 0.04))
    truth = made.run.scenario.model.k_o
    assert _count_deviations(found, "k_o", truth) < 3.0


def test_a_part_that_its_columns_describe_as_well_stays_out_of_the_plant() -> None:
    scenario = load_scenario(ScenarioName.THROTTLE_STEPS)
    made = record_bench(scenario, 0, ROUGH, effects={EffectId.PROGRESSIVE_SHAFT: 0.05})
    posed, start = problem(made)
    plain = fit_multistart(posed, start, [made.signals.shift])
    assert try_plants(plain, EffectPriors()).plant is None
