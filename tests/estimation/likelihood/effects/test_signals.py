# SPDX-License-Identifier: MIT
"""Lags and delays of inputs against closed forms, and the signs of their columns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.effect import evaluate_operating_point
from drivetwin.estimation.likelihood.effects.signals import (
    apply_pressure_delay,
    apply_torque_lag,
    build_pressure_delay,
    build_torque_lag,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import NominalRun, SyntheticVehicle
from drivetwin.simulation.dual_clutch import Signal
from tests.estimation.likelihood.effects.test_columns import operating_point
from tests.estimation.likelihood.fixtures import bench, fitted
from tests.support.arrays import FloatArray

LAG = 0.03
LATE = 0.003
TIME = np.linspace(0.0, 1.0, 1001)


def _solve_lag(values: FloatArray, time: FloatArray, lag: float) -> FloatArray:
    """Output of a lag at rest before the first sample."""
    _, found, _ = lsim(([1.0], [lag, 1.0]), values - values[0], time - time[0])
    return np.asarray(found + values[0])


@pytest.mark.parametrize("size", [LAG, -LAG])
def test_the_slower_torque_is_the_lagged_faster_one(size: float) -> None:
    """An acting torque that lags is the lagged logged one; one whose log lags gives back the log.

    Both are without the delay, which is an unknown of its own.
    """
    at = operating_point()
    steady, time = at.record.steady_torque, at.middle
    age = at.term.structure.get_value(at.point, "te_delay")
    fine = np.arange(time[0], time[-1], 2e-4)
    logged = np.interp(fine + age, steady.time, steady.values)
    (found,) = build_torque_lag(at, size)
    change = np.interp(fine, time, found.inputs[TORQUE])
    acting = logged + change
    fast, slow = (logged, acting) if size > 0.0 else (acting, logged)
    expected = np.interp(fine + LAG, fine, _solve_lag(fast, fine, LAG))
    inside = (fine > fine[0] + 10.0 * LAG) & (fine < fine[-1] - 2.0 * LAG)
    largest = np.max(np.abs(change[inside]))
    assert largest > 0.0
    missed = np.sqrt(np.mean((slow - expected)[inside] ** 2))
    assert missed < 0.05 * largest


def test_a_positive_delay_acts_later_than_the_logged_pressure() -> None:
    fit = fitted()
    (term,) = fit.problem.terms
    at = evaluate_operating_point(term, fit.point)
    assert at is not None
    for one in build_pressure_delay(at, LATE):
        signal = bench().signals.pressures[one.subject]
        now, before = (np.interp(at.middle - age, signal.time, signal.values) for age in (0, 0.1))
        change = one.inputs[one.subject]
        slope = float(change @ (before - now)) / float((before - now) @ (before - now))
        assert 0.0 < slope < 1.0
        assert slope == pytest.approx(LATE / 0.1, rel=0.5)


def _build_vehicle(engine_torque: Signal) -> SyntheticVehicle:
    made = bench(noise=0.0).run
    nominal = NominalRun(made.scenario.model, made.trajectory, engine_torque, {"B3": engine_torque})
    return SyntheticVehicle.from_nominal(nominal, ("B2", "B3"), 1)


def test_a_lagged_ramp_follows_by_the_time_constant() -> None:
    vehicle = apply_torque_lag(_build_vehicle(Signal(TIME, 100.0 * TIME)), 0.05)
    exact = 100.0 * (TIME - 0.05 * (1.0 - np.exp(-TIME / 0.05)))
    assert np.allclose(vehicle.engine_torque.values, exact, atol=1e-10)


def test_a_delayed_input_has_its_first_value_until_it_starts() -> None:
    logged = Signal(TIME, np.cos(TIME))
    delayed = apply_pressure_delay(_build_vehicle(logged), 0.0125).pressures["B3"]
    values = np.interp(TIME, delayed.arrival, delayed.values)
    assert np.allclose(values, np.interp(TIME - 0.0125, TIME, logged.values), atol=1e-12)
    assert delayed.arrival[0] == 0.0
