# SPDX-License-Identifier: MIT
"""Tasks for the tests of calibration, from a twin as the command makes them, and their runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.calibration.calibrate import Task, draw_for
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import ClosedLoop, compute_nominal_profiles
from drivetwin.calibration.metrics import list_outputs
from drivetwin.calibration.objective import CalibrationSettings
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.scenarios import Purpose, collect_scenarios
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.twin.twin import Twin
from tests.calibration.twins import extend_twin, make_hydraulic_twin
from tests.support.arrays import FloatArray
from tests.support.upshift.statement import BAR

SYSTEM = 10.0 * BAR
QUICK = CalibrationSettings(
    starts=2,
    hops=1,
    finalists=1,
    search_iterations=3,
    search_draws=8,
    polish_draws=16,
    tail_draws=16,
    check_draws=100,
    repairs=3,
    repair_iterations=2,
    certificate_draws=60,
    promise_types=5,
    promise_units=12,
    neighbour_draws=6,
    neighbour_iterations=1,
    neighbour_fresh_draws=20,
    tail_iterations=3,
)


SHIFTS: dict[str, dict[str, Any]] = {
    "power-on upshift": {"gears": "23"},
    "power-off downshift": {"gears": "32", "torque": -150.0, "speed": 120.0, "load": -2000.0},
    "power-on downshift": {"gears": "32", "torque": 900.0, "speed": 120.0},
    "power-off upshift": {"gears": "23", "torque": -150.0, "speed": 170.0, "load": -2000.0},
}
"""Arguments of `make_task` for each kind of shift; the last two have the inertia phase first."""


def make_task(
    gears: str = "23",
    torque: float = 1400.0,
    speed: float = 185.0,
    load: float | None = None,
    twin: Twin | None = None,
    **given: Any,
) -> Task:
    """Return the task of a request; the load of the vehicle [N m] is that of the twin or given."""
    twin = twin or make_hydraulic_twin()
    if load is not None:
        of = replace(twin.parameters["Tv_over_if"], value=load / twin.final_drive)
        twin = replace(twin, parameters={**twin.parameters, "Tv_over_if": of})
    for name, value in (("limits", ()), ("settings", QUICK), ("system_pressure", SYSTEM)):
        given.setdefault(name, value)
    given |= {"engine_torque": torque, "engine_speed": speed}
    return build_task(twin, Request(gears=(gears[0], gears[1]), **given))


def make_task_with(values: Mapping[str, float], kind: PolicyKind = PolicyKind.CONTROLLER) -> Task:
    """Return the task of a twin with more parameters, as those of an added element."""
    return make_task(twin=extend_twin(make_hydraulic_twin(), values), policy=kind)


def start(task: Task) -> Any:
    """Return the control of the starting values."""
    return task.policy.build_control(np.array([one.start for one in task.policy.parameters]))


def start_profiles(task: Task) -> Any:
    """Return the profiles at the clutches of the nominal driveline for the starting values."""
    return compute_nominal_profiles(task.maneuver, start(task))


def draw(task: Task, count: int, purpose: str = "SEARCH") -> Any:
    """Draw scenarios of a task."""
    return draw_for(task, count, Purpose[purpose])


def make_nominal(task: Task, control: Any) -> Any:
    """Return the nominal driveline, with its actuators for a closed loop."""
    nominal = collect_scenarios(task.maneuver, [task.maneuver.driveline])
    return replace(nominal, units=[control.unit]) if isinstance(control, ClosedLoop) else nominal


def make_plant(shift: Any) -> Plant:
    """Plant on one thread."""
    return Plant(shift, threads=1)


def run_nominal(task: Task, control: Any) -> FloatArray:
    """Return shaft torque, and torque and slip of both elements (5, n), nominal."""
    shift, nominal = task.maneuver, make_nominal(task, control)
    runs = make_plant(shift).simulate(control, nominal, list_outputs(shift))
    return np.asarray(runs.columns[0])
