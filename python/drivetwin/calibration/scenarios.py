# SPDX-License-Identifier: MIT
"""Scenarios: drivelines drawn from the identified covariance and the spread of made units.

All profiles of one search run through the same draws (common random numbers), so that differences
of their metrics are differences of the profiles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import DrawUnit
from drivetwin.errors import InputError
from drivetwin.parameters import OVER_ETA
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, Stribeck
from drivetwin.simulation.shift_control import ControlledUnit
from drivetwin.twin.distribution import ModelDistribution, describe_model
from drivetwin.twin.twin import Twin

_TRIES = 20
"""Draws per scenario after which a covariance counts as too wide."""


class Purpose(IntEnum):
    """Use of a set of draws; each has a stream of random numbers of its own."""

    SEARCH = 1
    POLISH = 2
    TAIL = 3
    CERTIFICATE = 4
    CHECK = 5


DrawModel = Callable[[np.random.Generator], DualClutch | None]
"""Draws a driveline; None where the draw is impossible."""


@dataclass(frozen=True, eq=False)
class Scenarios:
    """Drivelines as parameter sets of one batch: values (runs,) by the core's names.

    `units` are the actuators of each; empty where the control is given at the clutches.
    """

    sets: Mapping[str, FloatArray]
    count: int
    units: Sequence[ControlledUnit] = ()

    def select(self, part: slice | NDArray[np.bool_]) -> Scenarios:
        """Return a part of the scenarios."""
        places = np.arange(self.count)[part]
        sets = {name: values[part] for name, values in self.sets.items()}
        return Scenarios(sets, places.size, [self.units[k] for k in places if self.units])

    def join(self, more: Scenarios) -> Scenarios:
        """Return these scenarios and `more` of the same driveline."""
        sets = {name: np.concatenate([one, more.sets[name]]) for name, one in self.sets.items()}
        return Scenarios(sets, self.count + more.count, [*self.units, *more.units])


@dataclass(frozen=True)
class Draw:
    """Draws of the driveline, and of its actuators where these are simulated."""

    model: DrawModel
    unit: DrawUnit | None = None


def draw_scenarios(
    maneuver: Maneuver, draw: Draw, count: int, seed: int, purpose: Purpose
) -> Scenarios:
    """Draw `count` drivelines with steady starts. Actuators have random numbers of their own.

    Raises InputError where most draws are impossible (an inertia below zero).
    """
    random = np.random.default_rng([seed, int(purpose)])
    models: list[DualClutch] = []
    for _ in range(_TRIES * count):
        if len(models) == count:
            break
        model = draw.model(random)
        if model is not None and is_possible(model):
            models.append(model)
    if len(models) < count:
        raise InputError(
            f"{len(models)} of {_TRIES * count} drawn drivelines are possible",
            "identify from more logs, or fix weak parameters on the vehicle card: the intervals "
            "of the twin reach impossible values",
        )
    drawn = collect_scenarios(maneuver, models)
    if draw.unit is None:
        return drawn
    own = np.random.default_rng([seed, int(purpose), 1])
    return replace(drawn, units=[draw.unit(own) for _ in range(count)])


def collect_scenarios(maneuver: Maneuver, models: Sequence[DualClutch]) -> Scenarios:
    """Collect drivelines as parameter sets; names that are equal in all are left out.

    The start of each is its own steady acceleration: its shaft twist is a parameter too.
    """
    tables = [flatten_model(one) for one in models]
    base = flatten_model(maneuver.model)
    sets = {
        name: np.array([table[name] for table in tables])
        for name in base
        if any(table[name] != base[name] for table in tables)
    }
    sets["start.twist"] = np.array([maneuver.build_start(one).twist for one in models])
    return Scenarios(sets, len(models))


def flatten_model(model: DualClutch) -> dict[str, float]:
    """Return the numbers of a driveline that can differ between units, by the core's names."""
    table = {name: getattr(model, name) for name in ("J1", "eta", "J_out", "J_v", "k_o", "c_o")}
    table |= {f"load.{name}": value for name, value in vars(model.load).items()}
    for one in model.elements:
        table |= {f"{one.name}.gain": one.gain, f"{one.name}.P0": one.P0}
        law = one.friction
        numbers = (
            vars(law)
            if isinstance(law, Stribeck)
            else {f"mu.{k}": value for k, value in enumerate(law.mu)}
        )
        table |= {f"{one.name}.{name}": value for name, value in numbers.items()}
    return table


def is_possible(model: DualClutch) -> bool:
    """Return whether the core can run a driveline: inertias, stiffness and gains above zero."""
    above = (model.J1, model.J_out, model.J_v, model.k_o, model.eta)
    gains = [one.gain for one in model.elements]
    return min(*above, *gains) > 0.0 and model.c_o >= 0.0 and np.isfinite(above).all().item()


def scale_units(model: DualClutch, spread: Spread, random: np.random.Generator) -> DualClutch:
    """Draw a made unit around `model`: gains, contact pressure, and scale of the engine torque.

    A scale s of the engine torque is η·s with J1/s: the torque at the gears is the same. By the
    dissipative law this holds while the engine drives.
    """
    gains = random.normal(1.0, spread.gain, 2) if spread.gain else np.ones(2)
    scale = float(random.normal(1.0, spread.engine_torque))
    contact = float(random.normal(0.0, spread.contact_pressure))
    old, new = model.elements
    return replace(
        model,
        eta=model.eta * scale,
        J1=model.J1 / scale,
        elements=(
            replace(old, gain=old.gain * float(gains[0]), P0=old.P0 + contact),
            replace(new, gain=new.gain * float(gains[1]), P0=new.P0 + contact),
        ),
    )


@dataclass(frozen=True, eq=False)
class TwinDraws:
    """Draws of a twin: parameters and friction laws by their joint covariance, and made units.

    The covariance is the total one, with sensor tolerances and effects.
    """

    twin: Twin
    shift: Shift
    spread: Spread

    def __call__(self, random: np.random.Generator) -> DualClutch | None:
        """Draw a driveline; None where it is impossible."""
        known = self._known
        model = known.draw_model(known.draw(random, self._directions), random)
        return None if model is None else scale_units(model, self.spread, random)

    @cached_property
    def _known(self) -> ModelDistribution:
        return describe_model(self.twin, self.shift, self.drawn_ids)

    @cached_property
    def _directions(self) -> FloatArray:
        return self._known.directions

    @cached_property
    def drawn_ids(self) -> list[str]:
        """Ids of the covariance that the model of the shift depends on."""
        twin, used = self.twin, set(self.twin.list_model_ids(self.shift))
        gear = twin.select_inertia_gear(self.shift)
        used -= {name for name in used if name.startswith("J_prime_")}
        used.add(f"J_prime_{gear}")
        return [
            one
            for one in twin.covariance_ids
            if one.removesuffix(OVER_ETA) in used and twin.parameters[one].value is not None
        ]
