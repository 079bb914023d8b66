# SPDX-License-Identifier: MIT
"""Friction that differs from a Stribeck law over slip."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.direct.friction_law import evaluate_stribeck
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect, OperatingPoint
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    SyntheticVehicle,
    compute_friction_work,
)
from drivetwin.estimation.likelihood.motion import Contact
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.dual_clutch import FrictionTable
from drivetwin.vehicle.effects import EffectId

_PERIODS, _SLIP_RANGE, _SLIP_STEPS = 2.0, 1.25, 250
"""Wave of μ in a synthetic log: periods over the slips of an element, range of its table over the
largest slip of the nominal run, and number of its pieces."""

WAVES = 6
"""Shapes of friction over slip: so many half cosines over the root of slip."""
GRID = 200
"""Slips at which shapes are projected onto the Stribeck law."""


@dataclass(frozen=True, eq=False)
class FrictionShapes:
    """Basis functions orthogonal to the Stribeck law `law` (4,), up to the slip `largest`
    [rad/s]: cosines over the root of slip, less their projection onto the slopes of the law."""

    law: FloatArray
    largest: float

    def evaluate(self, slip: FloatArray) -> FloatArray:
        """Evaluate each shape (n, WAVES) at |slip| (n,)."""
        grid = self.largest * np.linspace(0.0, 1.0, GRID) ** 2
        slopes = evaluate_stribeck(self.law, grid)[1].T
        by_law = np.linalg.lstsq(slopes, self._evaluate_waves(grid), rcond=None)[0]
        return np.asarray(
            self._evaluate_waves(slip) - evaluate_stribeck(self.law, slip)[1].T @ by_law
        )

    def _evaluate_waves(self, slip: FloatArray) -> FloatArray:
        place = np.sqrt(np.clip(slip / self.largest, 0.0, 1.0))
        return np.cos(np.pi * np.outer(place, np.arange(1, WAVES + 1)))


def has_free_law(point: ParameterVector, element: str) -> bool:
    """Return whether all coefficients of the friction law of an element are unknowns."""
    return f"{element}.{LAW[-1]}" in point.names


def build_shapes(at: OperatingPoint, element: str) -> FrictionShapes:
    """Build the shapes of an element over the slips at which it transmits torque."""
    contact = at.evaluate_contact(element)
    loaded = np.abs(contact.slip[contact.per_mu != 0.0])
    law = np.array([at.point[f"{element}.{key}"] for key in LAW])
    return FrictionShapes(law, max(float(np.max(loaded, initial=0.0)), 1.0))


def build_friction_disturbance(element: str, contact: Contact, relative: FloatArray) -> Disturbance:
    """Build the action of a `relative` change (N-1,) of μ: the same change of the pressure above
    P0 makes the same torque."""
    slips = contact.per_mu != 0.0
    return Disturbance(element, inputs={element: relative * contact.above * slips})


def build_friction_shape(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add each shape to the friction of every element whose law is free."""
    found = []
    for one in at.term.plant.elements:
        if not has_free_law(at.point, one.name):
            continue
        contact = at.evaluate_contact(one.name)
        shapes = build_shapes(at, one.name).evaluate(np.abs(contact.slip))
        changes = std * shapes / contact.friction[:, None]
        found += [build_friction_disturbance(one.name, contact, each) for each in changes.T]
    return found


def apply_friction_shape(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a wave to the friction of each element that slips."""
    share, elements = np.linspace(0.0, _SLIP_RANGE, _SLIP_STEPS + 1), []
    for one in vehicle.model.elements:
        largest = vehicle.nominal.get_largest_slip(one.name)
        wave = size * np.sin(2.0 * np.pi * _PERIODS * share)
        mu = one.friction.evaluate(largest * share) + wave
        table = FrictionTable(tuple((largest * share).tolist()), tuple(mu.tolist()))
        elements.append(replace(one, friction=table) if largest > 0.0 else one)
    return vehicle.replace_elements(elements)


FRICTION_SHAPE = Effect(
    EffectId.FRICTION_SHAPE,
    "friction that departs from a Stribeck law over slip",
    "change of μ per shape",
    0.002,
    "engineering estimate: friction curves of paper linings scatter about a Stribeck law by 1 to "
    "2 % of μ",
    "compare with friction of free shape ('drivetwin examine --friction free')",
    build_friction_shape,
    apply_friction_shape,
    random=True,
)


def build_friction_pressure(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let μ rise with the pressure above P0, less the mean over the slipping phase."""
    found = []
    for one in at.term.plant.elements:
        contact = at.evaluate_contact(one.name)
        slips = contact.per_mu != 0.0
        if not has_free_law(at.point, one.name) or not np.any(slips):
            continue
        share = contact.above / float(np.max(contact.above[slips]))
        relative = std * (share - float(np.mean(share[slips])))
        found.append(build_friction_disturbance(one.name, contact, relative))
    return found


def apply_friction_pressure(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Let μ rise with pressure about the middle of the range in which an element slips."""
    factors = {}
    for one in vehicle.model.elements:
        span = vehicle.nominal.get_pressure_range(one.name, one.P0)
        if span > 0.0:
            share = np.minimum(vehicle.get_pressure_above(one) / span, 1.0)
            factors[one.name] = 1.0 + size * (share - 0.5)
    return vehicle.scale_friction(factors)


FRICTION_PRESSURE = Effect(
    EffectId.FRICTION_PRESSURE,
    "friction that depends on pressure",
    "of μ over the range of pressure",
    0.03,
    "typical range of paper linings: μ falls by 2 to 5 % per MPa; see Mäki, Wet Clutch Tribology, "
    "2005, on friction over pressure",
    "check P0 of the element on the card, which acts alike; record shifts at two pressure levels",
    build_friction_pressure,
    apply_friction_pressure,
    limit=2.0,
)


def build_friction_heat(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let μ fall with the friction work done, as a share of that of the whole shift."""
    found = []
    for one in at.term.plant.elements:
        if not has_free_law(at.point, one.name):
            continue
        contact = at.evaluate_contact(one.name)
        torque = contact.per_mu * contact.friction
        work = np.cumsum(np.abs(contact.slip * torque) * np.diff(at.run.time))
        if work[-1] > 0.0:
            found.append(build_friction_disturbance(one.name, contact, -std * work / work[-1]))
    return found


def apply_friction_heat(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Let μ fall with the friction work of the heated run, over that of the nominal one."""
    nominal, factors = vehicle.nominal.trajectory, {}
    for one in vehicle.model.elements:
        whole = float(compute_friction_work(nominal, one.name)[-1])
        if whole > 0.0:
            work = compute_friction_work(vehicle.heated, one.name)
            share = np.interp(vehicle.pressures[one.name].arrival, nominal.time, work) / whole
            factors[one.name] = np.maximum(1.0 - size * share, 0.0)
    return vehicle.scale_friction(factors)


FRICTION_HEAT = Effect(
    EffectId.FRICTION_HEAT,
    "friction that falls with the friction work",
    "of μ over the work of the shift",
    0.03,
    "typical range of paper linings: μ falls by 3 to 10 % per 100 K, a shift heats the surface by "
    "30 to 60 K; see Mäki, Wet Clutch Tribology, 2005, on friction over temperature",
    "record shifts that differ in friction work",
    build_friction_heat,
    apply_friction_heat,
    limit=1.0,
)


EFFECTS = (FRICTION_SHAPE, FRICTION_PRESSURE, FRICTION_HEAT)
