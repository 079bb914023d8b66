# SPDX-License-Identifier: MIT
"""Loads of shifts as departures from their mean, and whether they may all be one."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivetwin._util.arrays import Span
from drivetwin.estimation.data.shift_data import MeasuredSignal, ShiftSignals
from drivetwin.estimation.likelihood.parametrization import build_load_deviations
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.per_shift_load import fit_common_load
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.simulation.variable import Variable
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.likelihood.fixtures import bench, truth_of

NAMES = ("Tv_over_if", "J_vehicle", "start1.load", "start2.load")
LOADS = (600.0, 400.0, 200.0)
CHANNELS = ("engine_torque", "output_torque", "engine_speed", "output_speed", "wheel_speed")
PHASES = ("before", "torque_phase", "inertia_phase", "after")


def _fit(departures: tuple[float, float]) -> Any:
    """Unknowns whose departures have a standard deviation of 10 N m, and go with J3."""
    rows = np.array([[2.0, 0, 0, 0], [0, 5, 3, 0], [0, 0, 10, 0], [0, 0, 4, 10]])
    point = ParameterVector(NAMES, np.array([500.0, 4000.0, *departures]))
    return cast("Any", SimpleNamespace(point=point, covariance=rows @ rows.T))


def test_loads_that_may_be_one_are_taken_for_one() -> None:
    fit = _fit((8.0, 3.0))
    told = fit_common_load(fit)
    assert told is not None
    point, covariance = told
    assert point.names == NAMES[:2]
    # Measuring the departures as zero, exactly: the conditional mean and covariance.
    weight = np.linalg.inv(fit.covariance)
    assert np.linalg.inv(covariance) == pytest.approx(weight[:2, :2])
    pull = weight[:2, :2] @ (fit.point.values[:2] - point.values) + weight[:2, 2:] @ [8.0, 3.0]
    assert pull == pytest.approx(np.zeros(2), abs=1e-9)


def test_loads_that_differ_stay_apart() -> None:
    assert fit_common_load(_fit((40.0, 3.0))) is None


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


def test_departures_add_up_to_zero_about_the_load_of_the_log() -> None:
    problem, point = _three()
    structures = [part.structure for part in problem.parts]
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
