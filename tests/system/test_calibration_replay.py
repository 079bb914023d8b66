# SPDX-License-Identifier: MIT
"""Calibrations simulated anew by SciPy, without solver, controller and actuators of the program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np
import pytest

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.closed_loop import ClosedLoop, Control
from drivetwin.calibration.controller_policy import build_controller_policy
from drivetwin.calibration.knot_policy import build_knot_policy
from drivetwin.calibration.metrics import METRICS, Metric, Outcome, compute_metrics
from drivetwin.calibration.policy import Policy
from drivetwin.calibration.scenarios import Scenarios, collect_scenarios
from tests.calibration.cases import ACTUATOR, SYSTEM, make_plant, make_slip_policy, make_upshift
from tests.support.upshift.closed_loop import Controlled, Given, Valve, solve_tasks
from tests.support.upshift.scenario import build_model
from tests.support.upshift.statement import STEP, Inputs, Problem, make_problem

SHIFT = replace(make_upshift(), request=0.2, horizon=1.5)
TORQUE, LAG = SHIFT.point.engine_torque, 0.06
"""Engine torque [N m] and its time constant in the replayed unit [s]."""
NEAR = {"rad/s": 0.01, "N*m": 2.0}
"""Absolute tolerances by unit, of metrics that may be zero."""


def make_unit() -> Problem:
    """Return a made unit."""
    of = make_problem()
    (old, new), (first, last) = of.gain, of.P0
    return replace(of, gain=(0.97 * old, 1.03 * new), P0=(1.05 * first, 1.05 * last))


def calibrate_values(policy: Policy, values: Mapping[str, float]) -> Control:
    """Return the control of a policy with some calibrated values."""
    return policy.build_control(
        np.array([values.get(one.name, one.start) for one in policy.parameters])
    )


def solve(control: Control, of: Problem) -> tuple[FloatArray, float]:
    """Solve a shift by SciPy."""
    count = round(SHIFT.horizon / STEP) + 1
    first = Inputs(SHIFT.time, np.full(count, TORQUE), (np.full(count, SYSTEM), np.zeros(count)))
    if not isinstance(control, ClosedLoop):
        signals = control.engine_torque, control.offgoing, control.oncoming
        return solve_tasks(Given(of, first, [(one.time, one.values) for one in signals]), count)
    given = {k: v for k, v in asdict(control.controller).items() if isinstance(v, float)}
    actuator = ACTUATOR.model
    lags = actuator.dead_time, actuator.rising_lag, actuator.falling_lag, actuator.damping
    valves = tuple(Valve(*lags, start, commands=[(-1.0, start)]) for start in (SYSTEM, 0.0))
    return solve_tasks(Controlled(of, first, given, (valves[0], valves[1]), LAG), count)


def simulate(control: Control, of: Problem) -> Outcome:
    """Simulate a shift by the program."""
    drawn = collect_scenarios(SHIFT, [build_model(of)])
    units = []
    if isinstance(control, ClosedLoop):
        units = [replace(control.unit, engine_lag=LAG)]
    return make_plant(SHIFT).evaluate(control, Scenarios(drawn.sets, 1, units))


def make_policies() -> dict[str, Policy]:
    controller = build_controller_policy(SHIFT, SYSTEM)
    starts = np.array([one.start for one in controller.parameters])
    return {
        "controller": controller,
        "knots": build_knot_policy(SHIFT, controller.build_control(starts), SYSTEM),
        "slip": make_slip_policy(SHIFT),
    }


CALIBRATED: dict[str, dict[str, float]] = {"controller": {}, "knots": {}, "slip": {}}
"""Values that a calibration has found."""


@pytest.mark.parametrize("kind", list(CALIBRATED))
def test_metrics_are_those_of_another_simulator(kind: str) -> None:
    control, of = calibrate_values(make_policies()[kind], CALIBRATED[kind]), make_unit()
    found = simulate(control, of)
    columns, lock = solve(control, of)
    expected = compute_metrics(SHIFT, columns[None], np.array([lock]), np.array([of.J_v]))
    for metric, spec in METRICS.items():
        share = 1e-3 if metric is Metric.PEAK_JERK else 1e-2
        value = float(expected.values[metric][0])
        near = NEAR.get(spec.unit, 0.0)
        assert found.values[metric][0] == pytest.approx(value, rel=share, abs=near), metric
    assert not found.unlocked[0]
