# SPDX-License-Identifier: MIT
"""Calibrations simulated anew by SciPy, without solver, controller and actuators of the program."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.calibrate import calibrate
from drivetwin.calibration.metrics import METRICS, Metric, Runs, compute_metrics
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.spread import Spread
from tests.calibration.cases import QUICK, SHIFTS, SYSTEM, make_task
from tests.calibration.twins import ACTUATOR, make_exact_twin
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats
from tests.support.upshift.closed_loop import Controlled, Given, Valve, solve_tasks
from tests.support.upshift.statement import Inputs, Problem, make_problem

LAG = 0.06
"""Time constant of the engine torque in the replayed unit [s]."""
NEAR = {"rad/s": 0.01, "N*m": 2.0}
"""Absolute tolerances by unit, of metrics that may be zero."""
ONE_SAMPLE = 1.001e-3
"""Tolerance of the response time [s], which is that of the first sample [1 ms] beyond a slip; the
thousandth is for the rounding of a difference of times."""
SHORT = replace(
    QUICK, starts=2, hops=1, search_iterations=4, search_draws=8, polish_draws=16,
    tail_draws=24, tail_iterations=2,
)  # fmt: skip
"""Search and polish within a second."""


CASES = {
    "upshift by knots": ("power-on upshift", PolicyKind.KNOTS),
    "upshift by a slip loop": ("power-on upshift", PolicyKind.SLIP),
    "downshift": ("power-off downshift", PolicyKind.CONTROLLER),
    "downshift with the power on": ("power-on downshift", PolicyKind.CONTROLLER),
}
EXACT = Spread(**dict.fromkeys(vars(Spread()), 0.0))
"""All draws are the nominal unit."""


def state_problem(shift: dict[str, Any]) -> Problem:
    """State the driveline of a shift without the program."""
    of = make_problem()
    if shift["gears"] == "32":
        of = replace(of, **{k: getattr(of, k)[::-1] for k in ("i_c", "i_out", "gain", "P0")})
    return replace(of, T_v=shift.get("load", of.T_v), speed=shift.get("speed", 185.0))


def solve(of: Problem, torque: float, control: Any, time: FloatArray) -> tuple[FloatArray, float]:
    """Solve a shift by SciPy."""
    held, empty = np.full(time.size, SYSTEM), np.zeros(time.size)
    first = Inputs(time, np.full(time.size, torque), (held, empty))
    if not hasattr(control, "controller"):
        signals = control.engine_torque, control.offgoing, control.oncoming
        given = Given(of, first, [(one.time, one.values) for one in signals])
        return solve_tasks(given, time.size)
    numbers = {k: v for k, v in asdict(control.controller).items() if isinstance(v, float)}
    actuator = ACTUATOR.model
    lags = actuator.dead_time, actuator.rising_lag, actuator.falling_lag, actuator.damping
    valves = tuple(Valve(*lags, start, commands=[(-1.0, start)]) for start in (SYSTEM, 0.0))
    return solve_tasks(Controlled(of, first, numbers, (valves[0], valves[1]), LAG), time.size)


@pytest.mark.parametrize("name", mark_repeats(CASES, ("upshift by a slip loop", "downshift")))
def test_a_calibration_has_the_metrics_of_another_simulator(name: str) -> None:
    kind, policy = CASES[name]
    given: dict[str, Any] = {"policy": policy, "engine_lag": LAG, "settings": SHORT}
    limits = (Limit(Metric.SHIFT_TIME, 1.0),)
    twin = make_exact_twin()
    task = make_task(**SHIFTS[kind], twin=twin, spread=EXACT, limits=limits, **given)
    calibrated = calibrate(task)
    jerk = [
        one.certificate.quantiles[Metric.PEAK_JERK].share_95
        for one in (calibrated.before, calibrated.after)
    ]
    assert jerk[1] < 0.8 * jerk[0]
    shift, of = task.maneuver, state_problem(SHIFTS[kind])
    columns, lock = solve(of, shift.point.engine_torque, calibrated.after.control, shift.time)
    expected = compute_metrics(shift, Runs(columns[None], np.array([lock])), np.array([of.J_v]))
    found = calibrated.after.outcome
    for metric, values in expected.values.items():
        spec = METRICS[metric]
        share = 1e-3 if metric is Metric.PEAK_JERK else 1e-2
        value = float(values[0])
        near = ONE_SAMPLE if metric is Metric.RESPONSE_TIME else NEAR.get(spec.unit, 0.0)
        assert found.values[metric] == pytest.approx(value, rel=share, abs=near), metric
    assert not found.unlocked.any()
