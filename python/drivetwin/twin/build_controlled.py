# SPDX-License-Identifier: MIT
"""Construction of a twin from logs of a gearbox control: that of one kind of shift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from scipy.constants import bar, zero_Celsius

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, ActuatorSource, IdentifiedActuator
from drivetwin.estimation.identification import OIL_TEMPERATURE
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.verdict import from_prior
from drivetwin.parameters import LAW_KEYS, make_law_id
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.tcu.identify import FittedShifts
from drivetwin.tcu.log import REFERENCE_OIL, ControllerShift
from drivetwin.tcu.plant import name_own
from drivetwin.tcu.statements import (
    Quantity,
    Slopes,
    assess_quantity,
    compute_capacity,
    find_used_pressure,
    take,
)
from drivetwin.tcu.unknowns import J_VEHICLE, Numbers, Own
from drivetwin.twin.twin import Twin, TwinElement, TwinGear
from drivetwin.vehicle.spec import PriorValue

_REFERENCE = 1000.0
"""Torque of the output shaft [N*m] at which the slip of the tyre is stated."""
_LEAST_SLIP = 1e-2
"""Slip below which the range of a friction law is not seen [rad/s]."""
_POINTS = 41
"""Points of a friction curve."""
_STATED = ("J_prime", "J_vehicle", "P0", "tyre_slip")
"""Stems of the parameters that the log determines; the others are values beside them."""
_ASSUMED = (
    "The lock-up clutch is closed: engine and turbine are one inertia.",
    "Friction, P0 and fill are those at 60 °C.",
    "The load is the mean of the fitted shifts of this kind.",
)


def build_shift_twin(found: FittedShifts, kind: str) -> Twin:
    """Build the twin of the shifts of a `kind`, such as 2-3, among the fitted ones."""
    shifts = [one for one in found.shifts if one.kind == kind]
    first, card, slopes = shifts[0], found.card, Slopes.from_fit(found)
    used = {name: find_used_pressure(card, found.shifts, name) for name in (first.off, first.on)}
    quantities = _list_parameters(found, shifts)
    laws = {
        make_law_id(name, key): one
        for name, at in used.items()
        for key, one in zip(LAW_KEYS, _list_law(name, at, slopes.values), strict=True)
    }
    covariance = slopes.compute_covariance([*quantities.values(), *laws.values()])
    levers, gears = card.levers[frozenset(first.gears)], dict(zip(used, first.gears, strict=True))
    elements = {
        name: _build_controlled_element(
            slopes.values, name, at, (levers[name], card.ratios[gears[name]])
        )
        for name, at in used.items()
    }
    J_e = [one.value + 2.0 * side * one.std for side in (-1, 1) for one in (card.engine_inertia,)]
    vehicle, by_wheel = card.vehicle_inertia, card.final_drive**2
    return Twin(
        name=f"{card.name} {kind}",
        method=Method.LIKELIHOOD,
        loss_law="paper",
        i_in=1.0,
        final_drive=card.final_drive,
        gears={gear: TwinGear(card.ratios[gear], name) for name, gear in gears.items()},
        elements=elements,
        J_prime_range=(0.5 * J_e[0], 2.0 * J_e[1]),
        J_vehicle_range=(0.5 * vehicle.value * by_wheel, 2.0 * vehicle.value * by_wheel),
        parameters=_estimate(found, slopes, quantities),
        friction={name: _build_curve(slopes, name, at, shifts) for name, at in used.items()},
        validity=_find_ranges(shifts),
        inputs={},
        settings={},
        assumptions=_ASSUMED,
        version=get_program_version(),
        covariance_ids=(*quantities, *laws),
        covariance=covariance,
        actuators={name: _build_actuator(slopes, name) for name in used},
        wheel_radius=card.wheel_radius.value,
    )


def _list_parameters(found: FittedShifts, shifts: Sequence[ControllerShift]) -> dict[str, Quantity]:
    """List the parameters of the twin by id, as functions of the absolute numbers."""
    card, first = found.card, shifts[0]
    nominal, drive = card.vehicle_inertia.value, card.final_drive

    def load(given: Mapping[str, float]) -> float:
        forces = [given[name_own(one, Own.LOAD)] for one in shifts]
        return float(np.mean(forces)) * card.rolling_radius * given[J_VEHICLE] / nominal

    def inertia(given: Mapping[str, float], ratio: float) -> float:
        return given["J_engine"] + given["J_turbine"] + given["J_output"] / ratio**2

    listed: dict[str, Quantity] = {
        "J_out": take("J_output"),
        "J_vehicle": lambda given: (given[J_VEHICLE] + given["J_rims"]) * drive**2,
        "Tv_over_if": load,
        "k_o": take("shaft_stiffness"),
        "c_o": take("shaft_damping"),
        "tyre_slip": lambda given: _REFERENCE / given["tyre_slip_stiffness"],
    }
    for gear in first.gears:
        listed[f"J_prime_{gear}"] = partial(inertia, ratio=card.ratios[gear])
    for name in (first.off, first.on):
        listed[f"P0.{name}"] = take(f"{name}.{Numbers.P0}", bar)
        listed[f"drum.{name}"] = take("J_drum", 0.5)
    return listed


def _estimate(
    found: FittedShifts, slopes: Slopes, quantities: Mapping[str, Quantity]
) -> dict[str, Estimate]:
    """Estimate the parameters with verdicts; those that take up other errors are design values."""
    estimates = {
        "eta": from_prior("eta", PriorValue(1.0)),
        "shaft_reference": from_prior("shaft_reference", PriorValue(_REFERENCE)),
    }
    for name, quantity in quantities.items():
        one = assess_quantity(found, slopes, name, quantity)
        if not name.startswith(_STATED):
            value = PriorValue(quantity(slopes.values), one.std_noise or 0.0)
            one = from_prior(name, value)
        estimates[name] = one
    return estimates


def _build_controlled_element(
    given: Mapping[str, float], name: str, at: float, place: tuple[float, float]
) -> TwinElement:
    """Build the design data of an element on its lever, with the gain at the used pressure."""
    lever, ratio = place
    kiss = given[f"{name}.{Numbers.P0}"]
    gain = compute_capacity(given, element=name, pressure=at) / (at - kiss) / bar
    drum = 0.5 * given["J_drum"]
    return TwinElement("clutch", 1.0 / lever, lever * ratio, gain, bar * kiss, 1.0, drum)


def _list_law(name: str, at: float, values: Mapping[str, float]) -> list[Quantity]:
    """List the coefficients of the friction law of an element over the gain at `values`."""

    def level(given: Mapping[str, float]) -> float:
        over = at - given[f"{name}.{Numbers.P0}"]
        return compute_capacity(given, element=name, pressure=at) / over

    nominal = level(values)
    return [
        lambda given: level(given) / nominal,
        lambda given: given[f"{name}.{Numbers.DROP}"] * level(given) / nominal,
        lambda given: given[f"{name}.{Numbers.SLOPE}"] * level(given) / nominal,
        lambda given: float(np.log(given["friction_speed"])),
    ]


def _build_curve(
    slopes: Slopes, name: str, at: float, shifts: Sequence[ControllerShift]
) -> FrictionCurve:
    """Build the friction curve of an element over the slips of its shifts."""
    listed = _list_law(name, at, slopes.values)
    mu_c, drop, mu_v, ln_v_s = (one(slopes.values) for one in listed)
    law = Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)
    slip = np.linspace(_LEAST_SLIP, _find_slip_range(shifts), _POINTS)
    covariance = slopes.compute_covariance(listed)
    half = Z95 * np.sqrt(propagate_variance(law.compute_slopes(slip).T, covariance))
    mu, none = law.evaluate(slip), np.empty(0)
    fields = np.array([[1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, law.v_s], [0, 0, 1, 0]], dtype=float)
    by_field = fields @ covariance @ fields.T
    return FrictionCurve(slip, mu, mu - half, mu + half, none, none, law, "likelihood", by_field)


def _state(value: float, _: Mapping[str, float]) -> float:
    """Return a value whatever the numbers."""
    return value


def _build_actuator(slopes: Slopes, name: str) -> IdentifiedActuator:
    """Build the actuator of an element: dead time, fill at 60 °C, lag, hysteresis."""
    kiss, lag = take(f"{name}.{Numbers.P0}", bar), take(f"{name}.{Numbers.LAG}", 0.5)
    of: dict[str, Quantity] = {
        "dead_time": take(f"{name}.{Numbers.DEAD}"),
        "rising_lag": lag,
        "falling_lag": lag,
        "damping": partial(_state, 1.0),
        "kiss_pressure": lambda given: given["spring_share"] * kiss(given),
        "fill_time": take(f"{name}.{Numbers.FILL}"),
        "hysteresis": take("hysteresis", bar),
    }
    ordered = [of[key] for key in QUANTITIES]
    model = ActuatorModel.from_values(np.array([one(slopes.values) for one in ordered]))
    covariance = slopes.compute_covariance(ordered)
    return IdentifiedActuator(model, covariance, source=ActuatorSource.SPEEDS)


def _find_slip_range(shifts: Sequence[ControllerShift]) -> float:
    """Find the largest slip [rad/s] at the turbine."""
    first, last = (one.speeds for one in (shifts[0], shifts[-1]))
    return float(max(np.ptp(first[:, 1]), np.ptp(last[:, 1]), 1.0))


def _find_ranges(shifts: Sequence[ControllerShift]) -> dict[str, tuple[float, float]]:
    """Find the ranges that the shifts cover: pressure, torque, speed, at their begin too."""

    def span(arrays: Sequence[FloatArray]) -> tuple[float, float]:
        return min(float(one.min()) for one in arrays), max(float(one.max()) for one in arrays)

    begins = [one.time.searchsorted(one.change) for one in shifts]
    label, oil = shifts[0].kind, REFERENCE_OIL + zero_Celsius
    torques = [one.torque[at : at + 1] for one, at in zip(shifts, begins, strict=True)]
    speeds = [one.speeds[at : at + 1, 0] for one, at in zip(shifts, begins, strict=True)]
    return {
        "pressure": span([each for one in shifts for each in one.commands.values()]),
        "torque": span([one.torque for one in shifts]),
        "speed": span([one.speeds[:, 0] for one in shifts]),
        f"torque {label}": span(torques),
        f"speed {label}": span(speeds),
        OIL_TEMPERATURE: (oil, oil),
    }
