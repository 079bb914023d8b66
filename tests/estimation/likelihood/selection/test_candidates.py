# SPDX-License-Identifier: MIT
"""Terms of the load by evidence; minima about the P0 of an element that lingers there."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivetwin._util.arrays import Span
from drivetwin.dyno.actuators import Program
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import MULTI_START, fit_local
from drivetwin.estimation.likelihood.parametrization import build_load_deviations
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.candidates import (
    GROWING_LOAD,
    LOAD_OF_EACH_SHIFT,
    find_absent_terms,
    try_minima,
)
from drivetwin.estimation.likelihood.selection.select_model import select_model
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.simulation.variable import Variable
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, truth_of
from tests.support.bench import Bench, Knowledge, record_bench

ROUGH = Knowledge(J_out=0.1, P0=5e3)
PRESSURE = "B2.P0"
LOADS = (600.0, 400.0, 200.0)
CHANNELS = ("engine_torque", "output_torque", "engine_speed", "output_speed", "wheel_speed")
PHASES = ("before", "torque_phase", "inertia_phase", "after")
NAMES = ("Tv_over_if", "J_vehicle", "start1.load", "start2.load")


def _fit(deviations: tuple[float, float]) -> Any:
    """Unknowns whose deviations have a standard deviation of 10 N m, and go with J3."""
    rows = np.array([[2.0, 0, 0, 0], [0, 5, 3, 0], [0, 0, 10, 0], [0, 0, 4, 10]])
    point = ParameterVector(NAMES, np.array([500.0, 4000.0, *deviations]))
    loads = [SimpleNamespace(structure=SimpleNamespace(compute_load=lambda _: 500.0))]
    problem = SimpleNamespace(terms=loads)
    return cast("Any", SimpleNamespace(point=point, covariance=rows @ rows.T, problem=problem))


def test_loads_that_may_be_one_are_taken_for_one() -> None:
    fit = _fit((8.0, 3.0))
    absent, point = find_absent_terms(fit)
    assert LOAD_OF_EACH_SHIFT in absent
    assert GROWING_LOAD in absent
    assert point.names == NAMES[:2]
    # Measuring the deviations as zero, exactly: the conditional mean.
    weight = np.linalg.inv(fit.covariance)
    pull = weight[:2, :2] @ (fit.point.values[:2] - point.values) + weight[:2, 2:] @ [8.0, 3.0]
    assert pull == pytest.approx(np.zeros(2), abs=1e-9)


def test_loads_that_differ_stay_apart() -> None:
    absent, _ = find_absent_terms(_fit((40.0, 3.0)))
    assert LOAD_OF_EACH_SHIFT not in absent


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


def test_an_element_that_just_lets_go_is_not_looked_at_again() -> None:
    made = record_bench(load_scenario("paper_steps"), 0, ROUGH)
    law = made.run.scenario.model.loss_law
    problem, start = build_problem([made.signals], [made.driveline], law, truth_of(made))
    one = fit_local(problem, start)
    assert one is not None
    assert try_minima(one, problem) is one


def _later(signals: ShiftSignals, by: float) -> ShiftSignals:
    """The same shift `by` seconds later."""

    def moved(one: MeasuredSignal) -> MeasuredSignal:
        return replace(one, time=one.time + by)

    def span(one: Span) -> Span:
        return one[0] + by, one[1] + by

    shift = signals.shift
    channels: dict[str, Any] = {name: moved(getattr(signals, name)) for name in CHANNELS}
    phases: dict[str, Any] = {name: span(getattr(shift, name)) for name in PHASES}
    return replace(
        signals,
        **channels,
        pressures={name: moved(one) for name, one in signals.pressures.items()},
        shift=replace(shift, **phases, lockup_time=shift.lockup_time + by),
    )


def _three(known: dict[str, PriorValue] | None = None) -> Any:
    """The fit of one shift three times over, on a hilly road."""
    made = bench()
    driveline = replace(made.driveline, known=known or {})
    guess = truth_of(made) | build_load_deviations(LOADS)
    law = made.run.scenario.model.loss_law
    signals = [_later(made.signals, 20.0 * k) for k in range(3)]
    return build_problem(signals, [driveline] * 3, law, guess, hilly=True)


def test_load_deviations_add_up_to_zero_about_the_load_of_the_log() -> None:
    problem, point = _three()
    structures = [term.structure for term in problem.terms]
    assert [one.compute_load(point) for one in structures] == pytest.approx(LOADS)
    assert point["Tv_over_if"] == pytest.approx(np.mean(LOADS))
    for one in structures:
        constant = one.build_model(point.to_variables()).load.constant
        assert isinstance(constant, Variable)
        for k in (point.names.index(name) for name in ("start1.load", "start2.load")):
            values = point.values.copy()
            values[k] += 1.0
            change = (
                one.build_model(point.replace_values(values)).load.constant
                - one.build_model(point).load.constant
            )
            assert constant.slopes[k] == pytest.approx(change, abs=1e-6)


def test_a_load_that_is_known_is_that_of_all_shifts() -> None:
    _, point = _three({"Tv_over_if": PriorValue(2300.0, 10.0)})
    assert not [name for name in point.names if name.endswith(".load")]
