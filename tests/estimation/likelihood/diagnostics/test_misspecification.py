# SPDX-License-Identifier: MIT
"""Effects that the fit leaves out are told, and where there are none nothing is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.diagnostics.misspecification import (
    check_torque_delay,
    run_score_tests,
)
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from tests.estimation.likelihood.fixtures import fitted, problem, truth_of
from tests.support.bench import Bench, Knowledge, record_bench
from tests.support.shared_results import shared


@shared
def _with_delay(delay: float, role: str = "output_torque") -> tuple[Bench, LikelihoodFit]:
    """A log with one sensor late, and its fit."""
    base = load_scenario("paper_steps")
    sensors = [replace(one, delay=delay) if one.role == role else one for one in base.sensors]
    made = record_bench(replace(base, sensors=tuple(sensors)), 0, Knowledge())
    posed, start = problem(made)
    found = fit_local(posed, start)
    assert found is not None
    return made, found


@pytest.mark.parametrize("delay", [0.001, 0.002])
def test_a_late_torque_is_told_with_its_delay(delay: float) -> None:
    """To first order: 2 ms are 9 degrees of the oscillation."""
    _, found = _with_delay(delay)
    step = check_torque_delay(found)
    (seen,), (std,) = step.amounts, step.std
    assert abs(seen - delay) < 3.0 * std + 0.15 * delay
    (effect,) = run_score_tests(found)
    assert effect.finding.numbers["delay"].value == seen
    assert "ms late relative to the speeds" in effect.finding.text
    assert f"channels.output_torque.time_shift_s = -{seen:.4f}" in effect.finding.remedy


@pytest.mark.parametrize("seed", range(3))
def test_where_nothing_is_left_out_nothing_is_told(seed: int) -> None:
    found = fitted(seed)
    step = check_torque_delay(found)
    assert abs(step.amounts[0]) < 3.5 * step.std[0]
    assert list(run_score_tests(found)) == []


def test_what_a_late_torque_moves_is_not_identified() -> None:
    """The age of the engine torque takes nearly all of the delay."""
    made, found = _with_delay(0.002)
    told = build_estimates(found, [made.signals], [made.driveline], {}, {})
    assert Code.OUTPUT_TORQUE_LATE in [one.code for one in told.findings]
    age = told.estimates["te_delay"]
    assert age.verdict is Verdict.WEAK
    assert "With the output torque in time the log gives" in age.reason
    assert told.estimates["J_vehicle"].verdict is Verdict.IDENTIFIED


def test_slow_errors_of_a_sensor_widen_how_late_it_is() -> None:
    """Of four times the sensor's noise, which stays for half a period of the driveline."""
    _, found = _with_delay(0.002)
    (residual,), (part,) = found.normal.residuals, found.problem.parts
    torque = part.record.outputs[0]
    held = np.repeat(np.random.default_rng(1).standard_normal(torque.values.size // 50 + 1), 50)
    slow = residual.copy()
    slow[: torque.values.size] += 4.0 * torque.sigma * held[: torque.values.size]
    sure = check_torque_delay(found)
    unsure = check_torque_delay(replace(found, normal=replace(found.normal, residuals=(slow,))))
    assert unsure.std[0] > 2.0 * sure.std[0]


def test_a_late_pressure_is_told() -> None:
    """To first order: Stribeck's law bends to follow it, so that more than is seen may be late."""
    made, found = _with_delay(0.015, "pressure.B3")
    told = [one.finding for one in run_score_tests(found)]
    told = [one for one in told if one.code is Code.PRESSURE_LATE]
    assert len(told) == 1
    assert "ms late relative to its torque" in told[0].text
    assert "channels.pressure.B3.time_shift_s = -0.0" in told[0].remedy
    concluded = build_estimates(found, [made.signals], [made.driveline], {}, {})
    assert told[0] in concluded.findings


def test_friction_of_another_shape_is_told_and_its_band_holds_the_truth() -> None:
    base = load_scenario("paper_steps")
    (leaving, coming) = base.model.elements
    assert isinstance(coming.friction, Stribeck)
    slip = np.linspace(0.0, 200.0, 401)
    mu = coming.friction.evaluate(slip) + 0.01 * np.exp(-(((slip - 25.0) / 10.0) ** 2))
    humped = replace(coming, friction=FrictionTable(tuple(slip), tuple(mu)))
    model = replace(base.model, elements=(leaving, humped))
    usual = record_bench(base, 0, Knowledge())
    made = record_bench(replace(base, model=model), 0, Knowledge())
    law = base.model.loss_law
    posed, start = build_problem([made.signals], [made.driveline], law, truth_of(usual))
    found = fit_local(posed, start)
    assert found is not None
    told = build_estimates(found, [made.signals], [made.driveline], {}, {})
    assert any("Friction of B3 deviates from a Stribeck law" in one.text for one in told.findings)
    curve = told.friction["B3"]
    seen = (curve.slip > 5.0) & (curve.slip < 60.0)
    true = np.interp(curve.slip, slip, mu)
    inside = (curve.mu_lo <= true) & (true <= curve.mu_hi)
    assert np.mean(inside[seen]) > 0.9
    assert np.max(np.abs(curve.mu - true)[seen]) > 1e-3, "the case is of no use"
