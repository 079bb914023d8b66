# SPDX-License-Identifier: MIT
"""Calibrations simulated anew by SciPy, without solver, controller and actuators of the program."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np
import pytest

from drivetwin.calibration.calibrate import Task, calibrate
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.metrics import METRICS, Metric, Outcome, Runs, compute_metrics
from drivetwin.calibration.objective import Limit
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.table import POLICIES, PolicySetup
from drivetwin.calibration.profiles import ClosedLoop, Control
from drivetwin.calibration.scenarios import Draw, Scenarios, collect_scenarios
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import UnitDraws
from drivetwin.simulation.driveline import Driveline
from drivetwin.simulation.shift_control import ControlledUnit
from tests.calibration.cases import (
    ACTUATOR,
    QUICK,
    SYSTEM,
    make_draw,
    make_plant,
    make_slip_policy,
)
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats
from tests.support.upshift.closed_loop import Controlled, Given, Valve, solve_tasks
from tests.support.upshift.scenario import build_model
from tests.support.upshift.statement import Inputs, Problem, make_problem

LAG = 0.06
"""Time constant of the engine torque in the replayed unit [s]."""
NEAR = {"rad/s": 0.01, "N*m": 2.0}
"""Absolute tolerances by unit, of metrics that may be zero."""
ONE_SAMPLE = 1.001e-3
"""Tolerance of the response time [s], which is that of the first sample [1 ms] beyond a slip; the
thousandth is for the rounding of a difference of times."""
SHORT = replace(
    QUICK, population=12, first_evaluations=48, evaluations=120, search_draws=8, polish_draws=16,
    polish_iterations=4, tail_draws=24, tail_iterations=2,
)  # fmt: skip
"""Search and polish within a second."""


@dataclass(frozen=True)
class Case:
    """Nominal driveline, torque of its engine [N m] and policy of a calibration."""

    of: Problem
    torque: float
    kind: PolicyKind

    @property
    def shift(self) -> Maneuver:
        """Shift at the stated speed."""
        point = OperatingPoint(self.torque, self.of.speed)
        return Maneuver(build_model(self.of), point, 0.5, request=0.2, horizon=1.5)


def make_downshift() -> Problem:
    """Return the driveline in its upper gear, rolling downhill."""
    of = make_problem()
    swapped = {name: getattr(of, name)[::-1] for name in ("i_c", "i_out", "gain", "P0")}
    return replace(of, **swapped, T_v=-2000.0, speed=120.0)


CASES = {
    "upshift by knots": Case(make_problem(), 1400.0, PolicyKind.KNOTS),
    "upshift by a slip loop": Case(make_problem(), 1400.0, PolicyKind.SLIP),
    "downshift": Case(make_downshift(), -150.0, PolicyKind.CONTROLLER),
    "downshift with the power on": Case(
        replace(make_downshift(), T_v=make_problem().T_v), 900.0, PolicyKind.CONTROLLER
    ),
}


def build_task(case: Case) -> Task:
    """Return a short calibration with a limit of the shift time."""
    shift, draw = case.shift, make_draw(case.shift)
    unit = ControlledUnit(ACTUATOR.model, ACTUATOR.model, LAG)
    policy = POLICIES[case.kind](PolicySetup(shift, SYSTEM, unit, 0.01))
    if case.kind is PolicyKind.SLIP:
        policy = make_slip_policy(shift)
        draw = Draw(draw.driveline, UnitDraws(ACTUATOR, ACTUATOR, 0.05, Spread()))
    return Task(shift, policy, draw, (Limit(Metric.SHIFT_TIME, 1.0),), 1, SHORT)


def make_unit(of: Problem) -> Problem:
    """Return a made unit."""
    (old, new), (first, last) = of.gain, of.P0
    return replace(of, gain=(0.97 * old, 1.03 * new), P0=(1.05 * first, 1.05 * last))


def solve(case: Case, control: Control, of: Problem) -> tuple[FloatArray, float]:
    """Solve a shift of a unit by SciPy."""
    time = case.shift.time
    held, empty = np.full(time.size, SYSTEM), np.zeros(time.size)
    first = Inputs(time, np.full(time.size, case.torque), (held, empty))
    if not isinstance(control, ClosedLoop):
        signals = control.engine_torque, control.offgoing, control.oncoming
        given = Given(of, first, [(one.time, one.values) for one in signals])
        return solve_tasks(given, time.size)
    numbers = {k: v for k, v in asdict(control.controller).items() if isinstance(v, float)}
    actuator = ACTUATOR.model
    lags = actuator.dead_time, actuator.rising_lag, actuator.falling_lag, actuator.damping
    valves = tuple(Valve(*lags, start, commands=[(-1.0, start)]) for start in (SYSTEM, 0.0))
    return solve_tasks(Controlled(of, first, numbers, (valves[0], valves[1]), LAG), time.size)


def simulate(case: Case, control: Control, of: Problem) -> Outcome:
    """Simulate a shift of a unit by the program."""
    drawn = collect_scenarios(case.shift, [Driveline(build_model(of))])
    units = []
    if isinstance(control, ClosedLoop):
        units = [replace(control.unit, engine_lag=LAG)]
    return make_plant(case.shift).evaluate(control, Scenarios(drawn.sets, 1, units))


@pytest.mark.parametrize("name", mark_repeats(CASES, ("upshift by a slip loop", "downshift")))
def test_a_calibration_has_the_metrics_of_another_simulator(name: str) -> None:
    case = CASES[name]
    calibrated = calibrate(build_task(case))
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95
        for one in (calibrated.before, calibrated.after)
    )
    assert new < 0.8 * old
    control, of = calibrated.after.control, make_unit(case.of)
    found = simulate(case, control, of)
    columns, lock = solve(case, control, of)
    expected = compute_metrics(
        case.shift, Runs(columns[None], np.array([lock])), np.array([of.J_v])
    )
    for metric, values in expected.values.items():
        spec = METRICS[metric]
        share = 1e-3 if metric is Metric.PEAK_JERK else 1e-2
        value = float(values[0])
        near = ONE_SAMPLE if metric is Metric.RESPONSE_TIME else NEAR.get(spec.unit, 0.0)
        assert found.values[metric][0] == pytest.approx(value, rel=share, abs=near), metric
    assert not found.unlocked[0]
