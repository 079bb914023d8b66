# SPDX-License-Identifier: MIT
"""Truth behind a synthetic log and its effects, under the ids that identification uses."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from math import inf
from typing import Any

from drivetwin.actuator.model import QUANTITIES, ActuatorModel
from drivetwin.dyno.scenario import ControlledActuator, Scenario
from drivetwin.errors import InputError, Where
from drivetwin.estimation.likelihood.effects.shaft import build_input_shaft
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import (
    FrictionTable,
    Stribeck,
    Trajectory,
)
from drivetwin.simulation.linearize import compute_lockup_oscillation
from drivetwin.vehicle.effects import EffectId, parse_sizes

Effects = Mapping[EffectId, float]
"""Sizes by effect, in the units of its entry; an effect of size 0 changes nothing."""

SENSOR_EFFECTS = frozenset(name for name, one in EFFECTS.items() if one.on_sensor)
"""Effects that change recorded outputs and leave the motion as it is."""
_LIMITS = {name: one.limit for name, one in EFFECTS.items() if one.limit < math.inf}
_KEY = Where(key="effect")


def parse_effects(texts: Sequence[str]) -> dict[EffectId, float]:
    """Parse texts `NAME=SIZE`, such as `tyre_slip=0.004`.

    Raises InputError for another format, a repeated or unknown name, or an impossible size.
    """
    return check_effects(parse_sizes(texts, "effect"))


def check_effects(sizes: Mapping[str, float] | Effects) -> dict[EffectId, float]:
    """Check names and sizes of effects.

    Raises InputError for unknown names, sizes that are negative, not finite or too large, and for
    `backlash` together with `progressive_shaft`, which are two laws of one shaft.
    """
    unknown = [name for name in sizes if name not in list(EffectId)]
    if unknown:
        raise InputError(
            f"no effect {', '.join(map(repr, unknown))}",
            f"give any of {', '.join(EffectId)}",
            _KEY,
        )
    effects = {EffectId(name): float(size) for name, size in sizes.items()}
    bad = [
        f"{name} = {size:g}"
        for name, size in effects.items()
        if not (math.isfinite(size) and 0.0 <= size < _LIMITS.get(name, math.inf))
    ]
    if bad:
        limits = ", ".join(f"{name} below {limit:g}" for name, limit in _LIMITS.items())
        raise InputError(
            f"impossible sizes of effects: {', '.join(bad)}",
            f"give finite sizes from 0 on, {limits}",
            _KEY,
        )
    both = (EffectId.BACKLASH, EffectId.PROGRESSIVE_SHAFT)
    if all(effects.get(name, 0.0) > 0.0 for name in both):
        raise InputError(f"{' and '.join(both)} in one shaft", "give one of them", _KEY)
    return effects


SCHEMA = "drivetwin-truth/2"


@dataclass(frozen=True)
class Instants:
    """When a shift happened [s]; None where that did not happen.

    `torque_start` is where the on-coming element fills, `inertia_start` where the off-going one
    breaks away, `lockup` where the on-coming one locks.
    """

    start_gear: str
    end_gear: str
    torque_start: float | None
    inertia_start: float | None
    lockup: float | None


@dataclass(frozen=True)
class Truth:
    """Parameters by id (SI), friction law by element, the instants of all shifts, and effects.

    Parameters and laws are those of the dual-clutch model, without the `effects` of the run; the
    oscillation after lock-up is that with the input shaft, as sensors show it.
    """

    parameters: dict[str, float]
    friction: dict[str, Stribeck | FrictionTable]
    shifts: tuple[Instants, ...]
    effects: Effects
    actuators: Mapping[str, ActuatorModel] = field(default_factory=dict)
    """Hydraulics by element, of a scenario that has commands."""

    @property
    def torque_start(self) -> float | None:
        """Begin of the first shift's torque phase [s]."""
        return self.shifts[0].torque_start

    @property
    def inertia_start(self) -> float | None:
        """Begin of the first shift's inertia phase [s]."""
        return self.shifts[0].inertia_start

    @property
    def lockup(self) -> float | None:
        """Lock-up of the first shift [s]."""
        return self.shifts[0].lockup

    def as_dict(self) -> dict[str, Any]:
        """For the side file: `parameters` as id -> {value, unit}, curves as id -> coefficients."""
        return {
            "schema": SCHEMA,
            "parameters": {
                key: {"value": value, "unit": get_parameter_spec(key).unit}
                for key, value in self.parameters.items()
            },
            "friction": {name: asdict(law) for name, law in self.friction.items()},
            "shifts": [asdict(each) for each in self.shifts],
            "effects": {name.value: size for name, size in self.effects.items()},
            "actuators": {
                name: {
                    key: {"value": getattr(model, key), "unit": spec.unit}
                    for key, spec in QUANTITIES.items()
                }
                for name, model in self.actuators.items()
            },
        }


def compute_truth(scenario: Scenario, trajectory: Trajectory, effects: Effects) -> Truth:
    """Compute the true parameters and instants of a run.

    J' and Jo' are without the drums of open elements; a member of the whole gearbox that is no such
    drum and turns with both shafts counts with its parts on the diagonal (THEORY section 2).
    """
    model = scenario.model
    engine_side = model.J1 * model.eta + model.J2e
    delays = {sensor.role: sensor.delay for sensor in scenario.sensors}
    ratios = {gear.name: scenario.get_ratio(gear.element) for gear in scenario.gears}
    mode = effects.get(EffectId.INPUT_SHAFT_MODE, 0.0)
    front = build_input_shaft(model, mode) if mode > 0.0 else None
    rings = {
        gear.name: compute_lockup_oscillation(model, gear.element, front)
        for gear in scenario.gears[1:]
    }
    parameters = {
        "eta": model.eta,
        **{
            f"J_prime_{gear}": engine_side + model.J_out / ratio**2
            for gear, ratio in ratios.items()
        },
        "J_out": model.J_out,
        "J_vehicle": model.J_v,
        "Tv_over_if": (model.load.constant + model.load.rolling) / model.i_f,
        "k_o": model.k_o,
        "c_o": model.c_o,
        **{f"f_d_{gear}": one.frequency for gear, one in rings.items()},
        **{f"zeta_{gear}": one.damping for gear, one in rings.items()},
        **{f"P0.{element.name}": element.P0 for element in model.elements},
        "te_delay": delays["engine_torque"],
    }
    friction = {element.name: element.friction for element in model.elements}
    actuators = {
        name: one.model
        for name, one in scenario.actuators.items()
        if isinstance(one, ControlledActuator)
    }
    shifts = _collect_shifts(scenario, trajectory)
    return Truth(parameters, friction, shifts, effects, actuators)


def _collect_shifts(scenario: Scenario, trajectory: Trajectory) -> tuple[Instants, ...]:
    """The instants of each shift; an element's events count from the lock-up before."""
    found: list[Instants] = []
    after = -inf

    def first(element: str, kind: str) -> float | None:
        times = (e.time for e in trajectory.events if (e.element, e.kind) == (element, kind))
        return next((time for time in times if time > after), None)

    for old, new in pairwise(scenario.gears):
        instants = Instants(
            old.name,
            new.name,
            torque_start=first(new.element, "fill"),
            inertia_start=first(old.element, "break_away"),
            lockup=first(new.element, "lock"),
        )
        after = after if instants.lockup is None else instants.lockup
        found.append(instants)
    return tuple(found)
