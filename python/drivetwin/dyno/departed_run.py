# SPDX-License-Identifier: MIT
"""Run of a scenario whose vehicle departs from the dual-clutch model."""

from __future__ import annotations

import numpy as np

from drivetwin.dyno.acting_inputs import build_acting_inputs
from drivetwin.dyno.departed_vehicle import DepartedVehicle, compute_vehicle
from drivetwin.dyno.effects import SENSOR_EFFECTS, Effects
from drivetwin.dyno.nominal import NominalRun, compute_friction_work
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import InputError, SimulationError, Where
from drivetwin.simulation.dual_clutch import FloatArray, Trajectory
from drivetwin.vehicle.effects import EffectId

_ROUNDS = 30
"""Most runs until friction work and the friction that falls with it agree."""
_AGREEMENT = 1e-9
"""Change of the friction work between two runs, over its total, at which they agree."""


def is_departed(scenario: Scenario, effects: Effects) -> bool:
    """Return whether an effect changes the motion, and not the sensors alone.

    Raises InputError where it does and the scenario is none of a plain dual clutch.
    """
    moving = [name for name in effects if name not in SENSOR_EFFECTS]
    if moving and not (scenario.plant is None and scenario.converter is None):
        raise InputError(
            f"{', '.join(moving)} in scenario {scenario.name!r}, "
            "which has a whole gearbox or an open converter",
            f"choose a scenario of a dual clutch, or any of {', '.join(sorted(SENSOR_EFFECTS))}",
            Where(key="effect"),
        )
    return bool(moving)


def simulate_departed(
    scenario: Scenario, nominal: NominalRun, effects: Effects, seed: int, time: FloatArray
) -> Trajectory:
    """Simulate the scenario with `effects` on `time` (n,) [s].

    μ that falls with the friction work is found by repetition: each run has the friction of the
    work of the run before it. A failed run returns its status.
    Raises SimulationError where the repetition does not converge.
    """
    gears = [gear.element for gear in scenario.gears]
    vehicle = compute_vehicle(nominal, effects, gears, seed)
    heated = nominal.trajectory
    if effects.get(EffectId.FRICTION_HEAT, 0.0) > 0.0:
        heated = _heat(scenario, nominal, effects, vehicle)
    inputs = build_acting_inputs(nominal, effects, heated)
    return vehicle.simulate(*inputs, scenario.start(), time)


def _heat(
    scenario: Scenario, nominal: NominalRun, effects: Effects, vehicle: DepartedVehicle
) -> Trajectory:
    """Find the run, on the times of the nominal one, with the friction of its own work."""
    heated = nominal.trajectory
    for _ in range(_ROUNDS):
        inputs = build_acting_inputs(nominal, effects, heated)
        run = vehicle.simulate(*inputs, scenario.start(), heated.time)
        if run.status != "completed" or _compute_change(run, heated) < _AGREEMENT:
            return run
        heated = run
    raise SimulationError(
        f"friction and its work do not agree after {_ROUNDS} runs",
        f"give a smaller {EffectId.FRICTION_HEAT}",
    )


def _compute_change(run: Trajectory, before: Trajectory) -> float:
    """Largest change of the friction work of any element, over its total."""
    works = [(compute_friction_work(run, n), compute_friction_work(before, n)) for n in run.slip]
    return max(float(np.max(np.abs(a - b)) / max(float(b[-1]), 1.0)) for a, b in works)
