# SPDX-License-Identifier: MIT
"""Run of a scenario with effects that the dual-clutch model leaves out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.dyno.effects import SENSOR_EFFECTS, Effects
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.sensors import Sensor
from drivetwin.errors import InputError, SimulationError, Where
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    NominalRun,
    SyntheticVehicle,
    TorqueError,
    compute_friction_work,
)
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.simulation.dual_clutch import FloatArray, Trajectory
from drivetwin.vehicle.effects import EffectId

_ROUNDS = 30
"""Most runs until friction work and the friction that falls with it agree."""
_AGREEMENT = 1e-9
"""Change of the friction work between two runs, over its total, at which they agree."""
_ROLE = "output_torque"


def changes_motion(scenario: Scenario, effects: Effects) -> bool:
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


def delay_output_torque(
    sensors: tuple[Sensor, ...], error: TorqueError, effects: Effects
) -> tuple[Sensor, ...]:
    """Return the sensors with the delay of the output torque.

    Raises InputError for an effect in a sensor that is absent.
    """
    wanted = [name for name in SENSOR_EFFECTS if effects.get(name, 0.0) > 0.0]
    if wanted and _ROLE not in [sensor.role for sensor in sensors]:
        raise InputError(
            f"{', '.join(sorted(wanted))}: the scenario records no output torque",
            "choose a scenario with an output torque sensor",
            Where(key="effect"),
        )
    return tuple(
        replace(one, delay=one.delay + error.delay) if one.role == _ROLE else one for one in sensors
    )


def apply_effects(
    nominal: NominalRun,
    effects: Effects,
    gears: Sequence[str],
    seed: int,
    heated: Trajectory | None = None,
) -> SyntheticVehicle:
    """Apply the effects to the vehicle of a scenario.

    Parameters
    ----------
    nominal
        Run without effects.
    effects
        Sizes, see `EFFECTS`.
    gears
        Shift elements in the order of the gears.
    seed
        Seed of the random effects.
    heated
        Run on the times of the nominal one, from whose friction work μ falls; the nominal one by
        default.

    Returns
    -------
    SyntheticVehicle
        Vehicle of the scenario with the effects.
    """
    vehicle = SyntheticVehicle.from_nominal(nominal, gears, seed, heated)
    for name, effect in EFFECTS.items():
        if effects.get(name, 0.0) > 0.0:
            vehicle = effect.apply(vehicle, effects[name])
    return vehicle


def simulate_with_effects(
    scenario: Scenario, nominal: NominalRun, effects: Effects, seed: int, time: FloatArray
) -> Trajectory:
    """Simulate the scenario with `effects` on `time` (n,) [s].

    μ that falls with the friction work is found by repetition: each run has the friction of the
    work of the run before it. A failed run returns its status.
    Raises SimulationError where the repetition does not converge.
    """
    gears, start = [gear.element for gear in scenario.gears], scenario.start()
    heated = nominal.trajectory
    for _ in range(_ROUNDS):
        vehicle = apply_effects(nominal, effects, gears, seed, heated)
        if effects.get(EffectId.FRICTION_HEAT, 0.0) == 0.0:
            return vehicle.simulate(start, time)
        run = vehicle.simulate(start, heated.time)
        if run.status != "completed" or _compute_change(run, heated) < _AGREEMENT:
            return apply_effects(nominal, effects, gears, seed, run).simulate(start, time)
        heated = run
    raise SimulationError(
        f"friction and its work do not agree after {_ROUNDS} runs",
        f"give a smaller {EffectId.FRICTION_HEAT}",
    )


def _compute_change(run: Trajectory, before: Trajectory) -> float:
    """Compute the largest change of the friction work of any element, over its total."""
    works = [(compute_friction_work(run, n), compute_friction_work(before, n)) for n in run.slip]
    return max(float(np.max(np.abs(a - b)) / max(float(b[-1]), 1.0)) for a, b in works)
