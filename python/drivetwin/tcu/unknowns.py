# SPDX-License-Identifier: MIT
"""Unknowns of a gearbox with converter and their priors: of the vehicle, of an element, of a shift.

Torques and inertias have one factor in common that no log without a torque meter shows. They are
held for the nominal inertia of the vehicle; `J_vehicle` is a coordinate that no run depends on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivetwin.fit.unknown import Unknown
from drivetwin.tcu.card import ControllerCard
from drivetwin.vehicle.spec import PriorValue

J_VEHICLE = "J_vehicle"
"""Inertia of the vehicle at the gearbox output: the scale of all torques and inertias."""

GRAVITY = 9.81


class Numbers(StrEnum):
    """Number of an element, named `ELEMENT.NUMBER`."""

    GAIN = "gain"
    P0 = "P0"
    FILL = "fill_time"
    DEAD = "dead_time"
    LAG = "lag"
    DROP = "drop"
    SLOPE = "slope"
    CURVE = "curve"


class Own(StrEnum):
    """Number of one shift, named `shift N.NUMBER`."""

    LOAD = "load"
    RATE = "load rate"
    ENGINE = "start.engine"
    OUTPUT = "start.output"
    TWIST = "start.shaft"
    OFFSET = "torque offset"
    GAIN_OFF = "gain off"
    GAIN_ON = "gain on"
    FILL = "fill"


def find_own(name: str) -> Own | None:
    """Find the kind of a number of one shift by its name, None for a shared number."""
    head, _, number = name.partition(".")
    return Own(number) if head.startswith("shift ") else None


@dataclass(frozen=True)
class Stated:
    """Number with its prior: `std` relative where the number is positive by its law.

    `scaled` are numbers in proportion to all torques and inertias, `unit` in SI but for pressures
    in bar.
    """

    value: float
    std: float
    unit: str
    is_positive: bool = True
    scaled: bool = False

    def to_unknown(self, paths: Mapping[str, float] | None = None) -> Unknown:
        """Return the unknown that acts on paths of a network, None for one of an input."""
        std = self.std * self.value if self.is_positive else self.std
        bounds = (0.0, None) if self.is_positive else (None, None)
        return Unknown(self.value, std, bounds, paths, self.unit)


def _scale(value: float, std: float, unit: str) -> Stated:
    return Stated(value, std, unit, scaled=True)


def _free(value: float, std: float, unit: str = "1", *, scaled: bool = False) -> Stated:
    return Stated(value, std, unit, is_positive=False, scaled=scaled)


def _from_prior(prior: PriorValue) -> Stated:
    return Stated(prior.value, prior.std / prior.value, "kg*m^2", scaled=True)


def list_common(card: ControllerCard) -> dict[str, Stated]:
    """List the numbers of the vehicle by name. Priors without a source on the card are the ranges
    of passenger cars with planetary automatics."""
    mass = card.mass.value
    return {
        "torque_scale": _scale(0.85, 0.15, "1"),
        "torque_offset": _free(0.0, 6.0, "N*m", scaled=True),
        "torque_lag": Stated(0.045, 0.45, "s"),
        "torque_dead_time": _free(0.015, 0.01, "s"),
        "torque_map": _free(0.0, 0.035),
        "torque_speed": _free(0.0, 0.035),
        "J_engine": _from_prior(card.engine_inertia),
        "J_turbine": _from_prior(card.turbine_inertia),
        "J_drum": _scale(0.006, 0.5, "kg*m^2"),
        "J_output": _scale(0.06, 0.3, "kg*m^2"),
        "J_rims": _scale(4.5 / card.final_drive**2, 0.25, "kg*m^2"),
        "converter_scale": _scale(1.0, 0.05, "1"),
        "converter_tilt": _free(0.0, 0.04),
        "converter_ratio": Stated(1.0, 0.05, "1"),
        "converter_overrun": Stated(0.8, 0.2, "1"),
        "shaft_stiffness": _scale(mass / 2.0, 0.45, "N*m/rad"),
        "shaft_damping": _scale(6.0, 0.5, "N*m*s/rad"),
        "tyre_slip_stiffness": _scale(25.0 * mass * card.rolling_radius, 0.8, "N*m"),
        "drag_turbine": _free(1.0, 1.0, "N*m", scaled=True),
        "drag_viscous": _scale(0.01, 0.6, "N*m*s/rad"),
        "drag_output": _scale(0.004, 0.75, "N*m*s/rad"),
        "drag_clutch": _scale(0.7, 0.6, "N*m"),
        "friction_speed": Stated(3.8, 0.35, "rad/s"),
        "spring_share": Stated(0.8, 0.12, "1"),
        "hysteresis": Stated(0.06, 0.5, "bar"),
        "fill_temperature": _free(0.015, 0.008, "1/K"),
        "P0_temperature": _free(0.002, 0.002, "1/K"),
        "friction_temperature": _free(0.001, 0.001, "1/K"),
        "delay_engine_speed": _free(0.015, 0.008, "s"),
        "delay_input_speed": _free(0.01, 0.005, "s"),
        "delay_output_speed": _free(0.02, 0.006, "s"),
    }


def list_element(gain: PriorValue) -> dict[Numbers, Stated]:
    """List the numbers of an element with a design gain [N·m/bar]."""
    return {
        Numbers.GAIN: _scale(gain.value, gain.std / gain.value, "N*m/bar"),
        Numbers.P0: Stated(1.0, 0.25, "bar"),
        Numbers.FILL: Stated(0.19, 0.35, "s"),
        Numbers.DEAD: Stated(0.025, 0.45, "s"),
        Numbers.LAG: Stated(0.045, 0.4, "s"),
        Numbers.DROP: _free(0.08, 0.07),
        Numbers.SLOPE: _free(0.0, 0.0008, "s/rad"),
        Numbers.CURVE: _free(0.0, 0.015, "1/bar"),
    }


def list_lockup() -> dict[Numbers, Stated]:
    """List the numbers of the lock-up clutch: it slips in few shifts."""
    return {
        Numbers.GAIN: _scale(85.0, 0.3, "N*m/bar"),
        Numbers.P0: Stated(0.5, 0.4, "bar"),
        Numbers.LAG: Stated(0.06, 0.4, "s"),
    }


def list_own(card: ControllerCard, speed: float) -> dict[Own, Stated]:
    """List the numbers of one shift at a `speed` of the vehicle [m/s], but for its start.

    Offset of the torque, gains and fill are errors that change from shift to shift.
    """
    weight = card.mass.value * GRAVITY
    rolling = 0.013 * weight + 0.45 * speed**2
    return {
        Own.LOAD: _free(rolling, 0.025 * weight, "N"),
        Own.RATE: _free(0.0, 0.004 * weight, "N/s"),
        Own.OFFSET: _free(0.0, 4.0, "N*m"),
        Own.GAIN_OFF: _free(0.0, 0.03),
        Own.GAIN_ON: _free(0.0, 0.03),
        Own.FILL: _free(0.0, 0.12),
    }
