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
from drivetwin.calibration.friction_law import compute_scale_std, draw_law
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.units import DrawUnit
from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.parameters import OVER_ETA
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FrictionTable,
    ShiftElement,
    Stribeck,
)
from drivetwin.simulation.shift_control import ControlledUnit
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
    """Draws of a twin: parameters by covariance, friction by its band, and made units.

    The covariance is the total one, with sensor tolerances and effects. The friction law of each
    element is drawn by its covariance. The curve is scaled as a whole by what its band in the
    middle has beside it.
    """

    twin: Twin
    shift: Shift
    spread: Spread

    def __call__(self, random: np.random.Generator) -> DualClutch | None:
        """Draw a driveline; None where it is impossible."""
        overrides = self._draw_parameters(random)
        if any(value <= 0.0 and name != "Tv_over_if" for name, value in overrides.items()):
            return None
        model = self.twin.build_dual_clutch(self.shift, overrides=overrides)
        elements = [self._draw_friction(one, random) for one in model.elements]
        old, new = elements
        if old is None or new is None:
            return None
        return scale_units(replace(model, elements=(old, new)), self.spread, random)

    def _draw_parameters(self, random: np.random.Generator) -> dict[str, float]:
        twin = self.twin
        ids = self.drawn_ids
        if not ids or twin.covariance is None:
            return {}
        index = [twin.covariance_ids.index(one) for one in ids]
        mean = np.array([twin.get_value(one, 0.0) for one in ids])
        covariance = twin.covariance[np.ix_(index, index)]
        values = random.multivariate_normal(mean, covariance, method="eigh")
        return {
            name.removesuffix(OVER_ETA): float(value)
            for name, value in zip(ids, values, strict=True)
        }

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

    def _draw_friction(
        self, element: ShiftElement, random: np.random.Generator
    ) -> ShiftElement | None:
        """Draw the friction of an element; None where it is impossible."""
        curve = self._curves.get(element.name)
        scale = float(random.normal(1.0, self._scale_stds[element.name]))
        if curve is None or curve.stribeck_covariance is None:
            return scale_friction(element, scale)
        law = draw_law(curve, random)
        return None if law is None else scale_friction(replace(element, friction=law), scale)

    @cached_property
    def _curves(self) -> dict[str, FrictionCurve]:
        """Curves of μ by element; one over η is scaled as in the model."""
        eta = self.twin.get_value("eta", 1.0)
        return {
            name: curve.scale_by_eta(eta) if curve.over_eta else curve
            for name, curve in self.twin.friction.items()
        }

    @cached_property
    def _scale_stds(self) -> dict[str, float]:
        names = (self.shift.offgoing, self.shift.oncoming)
        return {name: compute_scale_std(self._curves.get(name)) for name in names}


def scale_friction(element: ShiftElement, scale: float) -> ShiftElement:
    """Return the element with its friction coefficient times `scale`."""
    law = element.friction
    if isinstance(law, FrictionTable):
        friction: Stribeck | FrictionTable = FrictionTable(
            law.slip, tuple(scale * value for value in law.mu)
        )
    else:
        friction = Stribeck(scale * law.mu_c, scale * law.mu_s, law.v_s, scale * law.mu_v)
    return replace(element, friction=friction)
