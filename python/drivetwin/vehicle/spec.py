# SPDX-License-Identifier: MIT
"""Design data of a vehicle in SI: ratios, elements, converter, ranges, distributions; shift kinds.

The distribution of a number as a person writes it is made here only. People round as well as cut.
The true ratio is therefore uniform within one unit of the last written digit to either side, which
has a standard deviation of 2/√12 = 0.58 of a unit. Digits say nothing about pressures, gains,
inertias and radii; their standard deviations are engineering estimates without a published source.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from drivetwin._util.toml import StrictModel, WrittenNumber
from drivetwin.actuator.model import ActuatorModel
from drivetwin.channels.units import BAR, RPM
from drivetwin.simulation.added_elements import Converter


class ShiftKind(StrEnum):
    """Direction and power state of a shift."""

    POWER_ON_UP = "power-on upshift"
    POWER_OFF_UP = "power-off upshift"
    POWER_ON_DOWN = "power-on downshift"
    POWER_OFF_DOWN = "power-off downshift"
    POWER_UNKNOWN_UP = "upshift, power unknown"
    POWER_UNKNOWN_DOWN = "downshift, power unknown"

    @classmethod
    def from_direction(cls, *, up: bool, power_on: bool | None) -> ShiftKind:
        """Return the kind of an upshift, or downshift, with the power on, off or (None) unknown."""
        if power_on is None:
            return cls.POWER_UNKNOWN_UP if up else cls.POWER_UNKNOWN_DOWN
        if up:
            return cls.POWER_ON_UP if power_on else cls.POWER_OFF_UP
        return cls.POWER_ON_DOWN if power_on else cls.POWER_OFF_DOWN

    @property
    def is_up(self) -> bool:
        """True for an upshift."""
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_UP,
            ShiftKind.POWER_UNKNOWN_UP,
        )

    @property
    def has_torque_phase_first(self) -> bool:
        """True where the on-coming element takes over the torque before the speeds change.

        Shifts of unknown power count as those with the power on.
        """
        return self in (
            ShiftKind.POWER_ON_UP,
            ShiftKind.POWER_OFF_DOWN,
            ShiftKind.POWER_UNKNOWN_UP,
        )


_PER_1000RPM = 1000.0 * RPM

Curve = Annotated[list[float], Field(min_length=2)]

_MEASURED, _OF_LARGEST = 0.02, 0.01
"""Power that a measured map may give too much: over that taken, or over that of the largest torque
of the pump, which is what errors near synchronism are small against."""


class ConverterTable(StrictModel):
    """`[converter]`: pump torque at 1000 rpm times `scale`, and torque ratio, over speed ratio."""

    speed_ratio: Curve
    torque_ratio: Curve
    pump_torque_at_1000rpm_Nm: Curve
    scale: Annotated[float, Field(gt=0)] = 1.0

    @model_validator(mode="after")
    def _check_lengths(self) -> ConverterTable:
        lengths = {len(self.torque_ratio), len(self.pump_torque_at_1000rpm_Nm)}
        if lengths != {len(self.speed_ratio)}:
            raise ValueError("torque_ratio and pump_torque go with the points of speed_ratio")
        if not all(a < b for a, b in pairwise(self.speed_ratio)):
            raise ValueError("speed_ratio must increase")
        if min(self.torque_ratio) < 0.0:
            raise ValueError("torque_ratio must not be negative")
        points = zip(
            self.speed_ratio, self.torque_ratio, self.pump_torque_at_1000rpm_Nm, strict=True
        )
        largest = max(map(abs, self.pump_torque_at_1000rpm_Nm))
        # Of the pump's power the share 1 - mν is lost; in overrun the pump gives the power.
        creating = [
            nu
            for nu, m, torque in points
            if torque * (1 - m * nu) < -max(_MEASURED * abs(torque), _OF_LARGEST * largest)
        ]
        if creating:
            at = ", ".join(f"{nu:g}" for nu in creating)
            raise ValueError(f"more power leaves than enters at speed_ratio {at}")
        return self

    @classmethod
    def from_converter(cls, converter: Converter) -> ConverterTable:
        """The table of a map in SI."""
        return cls(
            speed_ratio=list(converter.speed_ratio),
            torque_ratio=list(converter.torque_ratio),
            pump_torque_at_1000rpm_Nm=[
                round(each * _PER_1000RPM**2, 9) for each in converter.capacity
            ],
        )

    def to_spec(self) -> Converter:
        """Return the map in SI."""
        per_square = self.scale / _PER_1000RPM**2
        return Converter(
            speed_ratio=tuple(self.speed_ratio),
            capacity=tuple(torque * per_square for torque in self.pump_torque_at_1000rpm_Nm),
            torque_ratio=tuple(self.torque_ratio),
        )


ElementKind = Literal["brake", "clutch"]
Pair = tuple[float, float]
MOST_INERTIA = 1e8
"""Largest inertia of a card [kg m^2]: 40 times that of a haul truck of 600 t on wheels of 2 m."""
Z95 = 1.959963984540054
"""Half of a 95 % interval of a normal distribution, in standard deviations."""


@dataclass(frozen=True)
class PriorValue:
    """A design value and its standard deviation, same unit; `std` 0: taken as known.

    It is no float: a stage either uses the distribution or names the nominal `value`. `assumed`
    marks a value that nobody knows and that the card contains to make a first result possible.
    """

    value: float
    std: float = 0.0
    assumed: bool = False

    @property
    def half_width(self) -> float | None:
        """Half of the 95 % interval; None for an exact value."""
        return Z95 * self.std if self.std > 0.0 else None

    def scale(self, factor: float) -> PriorValue:
        """Return the quantity times an exact factor."""
        return replace(self, value=factor * self.value, std=abs(factor) * self.std)


@dataclass(frozen=True)
class SumPrior:
    """A normal prior on the sum of quantities, by name, times `factors`: `value` with `std`."""

    factors: Mapping[str, float]
    value: float
    std: float


@dataclass(frozen=True)
class SensorTolerance:
    """One standard deviation of a sensor's constant errors.

    `gain` is relative, `offset` in SI; `delay` [s] is how much older values are than their stamps.
    """

    gain: float = 0.0
    offset: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True)
class Gear:
    """A gear of the box: `ratio` = ω_in/ω_out without the input gear i_in; elements holding it;
    `eta` its efficiency, None if unknown."""

    name: str
    ratio: PriorValue
    elements: tuple[str, ...]
    eta: PriorValue | None = None


@dataclass(frozen=True)
class ClutchGeometry:
    """Friction surfaces N, de-rating D, area A [m^2] and effective radius r [m] of a clutch."""

    surfaces: int
    derating: float
    area: float
    radius: float

    @property
    def gain(self) -> float:
        """N·D·A·r [m^3]."""
        return self.surfaces * self.derating * self.area * self.radius


@dataclass(frozen=True)
class ElementSpec:
    """A clutch or brake that makes a gear.

    `gain` = N·D·A·r [m^3] (N friction surfaces, D de-rating, A area, r effective radius);
    capacity = μ·gain·(P - P0), static capacity `peak` times that at zero slip (THEORY section 1).
    `P0` [Pa] ends the fill; `drum_inertia` [kg m^2] rotates at slip speed (THEORY section 2).
    `i_c`, `i_out` are the ratios of eq. 15 where the card states them, `geometry` is what the gain
    is computed from where the card states it, `actuator` its hydraulics where the card states them.
    """

    name: str
    kind: ElementKind
    gain: PriorValue
    P0: PriorValue
    peak: float = 1.0
    drum_inertia: PriorValue = PriorValue(0.0)
    i_c: PriorValue | None = None
    i_out: PriorValue | None = None
    geometry: ClutchGeometry | None = None
    actuator: ActuatorModel | None = None


def compute_brake_ratios(ratio: float) -> tuple[float, float]:
    """Return (i_c, i_out) of a brake in a gear of `ratio` i: i_c = i - 1, i_out = i/(i - 1).

    Holds where the other elements of the gear are rotating clutches (THEORY section 2); both
    negative for i < 1. Raises ZeroDivisionError for i = 1, which no brake can make.
    """
    return ratio - 1.0, ratio / (ratio - 1.0)


def move_clutch_ratios(kind: ElementKind, i_c: float, i_out: float, ratio: float) -> Pair:
    """Return (i_c, i_out) of an element whose gear has another `ratio` (without the input gear).

    Those of a brake follow from the ratio if they did so before; else i_c stays.
    """
    old = i_c * i_out
    if kind == "brake" and math.isclose(i_c, old - 1.0, rel_tol=1e-6):
        return compute_brake_ratios(ratio)
    return i_c, ratio / i_c


def compute_middle(limits: tuple[float, float]) -> float:
    """A value in the midst of a design range: its geometric mean, a tenth of one from 0 on."""
    low, high = limits
    return math.sqrt(low * high) if low > 0.0 else 0.1 * high


DIGIT_STD = 2.0 / math.sqrt(12.0)
"""Standard deviation of a ratio in units of its last written digit [-]."""
GIVEN_DIGITS = 6
"""Significant digits of a ratio whose text is lost, as from a program [count]."""
FILL_PRESSURE_STD = 0.1 * BAR
"""Standard deviation of a P0 without a stated one [Pa]; engineering estimate."""
INERTIA_STD = 0.10
"""Standard deviation of an inertia without a stated one [ratio]; engineering estimate."""
MASS_STD = 0.05
"""Standard deviation of the mass of a vehicle without a stated range [ratio]; engineering estimate:
fuel, driver and load."""
WHEEL_RADIUS_STD = 0.02
"""Standard deviation of a wheel radius without a stated one [ratio]; engineering estimate: a tread
of 8 to 15 mm wears, which is 2 to 3 % of the radius."""
GAIN_STD = 0.05
"""Standard deviation of a clutch gain without a stated one [ratio]; engineering estimate: area,
radius and de-rating from a drawing, 3 to 5 %."""
ASSUMED_GAIN_STD = 0.2
"""Standard deviation of a gain that is assumed from a usual μ [ratio]; engineering estimate: μ of a
paper lining from 0.09 to 0.15, and the error of the product of μ and gain from a log."""
PARTNER_LEVEL_STD = 0.07
"""Standard deviation of the friction of an element that the log does not determine, over that of
its partner [ratio]; engineering estimate for two clutches with the same lining and oil."""
PARTNER_REST_STD = 0.015
"""Standard deviation of the rise of friction to zero slip of such an element beyond that of its
partner [-]; engineering estimate."""
CONVERTER_POINT_STD = 0.03
"""Standard deviation of a point of a converter map [ratio]; engineering estimate: test benches,
reading of a diagram."""
ENGINE_TORQUE_STD = 0.01
"""Standard deviation of the gain of an engine torque [ratio]: calibrated torque models of engine
controllers are within a few per cent."""
TORQUE_METER_STD = 0.005
"""Standard deviation of the gain of a torque meter [ratio]: installed ones have 0.1 to 1 %."""
CONVERTER_SCALE_STD = 0.03
"""Standard deviation of the scale that all capacities of a converter share [ratio]; engineering
estimate: oil temperature, production scatter."""
FRICTION_LEVEL_STD = 0.1
"""Standard deviation of the friction level of an element without an identified partner [ratio];
engineering estimate: a usual μ of a paper lining is 0.09 to 0.15."""
STRIBECK_SPEED_STD = 0.3
"""Standard deviation of the Stribeck speed of a friction law [ratio]; engineering estimate: linings
and oils of one kind differ by a factor of 2."""
VISCOUS_SLOPE_STD = 0.5
"""Standard deviation of the viscous slope of a friction law [ratio]; engineering estimate."""
PEAK_STD = 0.05
"""Standard deviation of static over kinetic capacity [-]; engineering estimate."""
STIFFNESS_STD = 0.1
"""Standard deviation of a stiffness [ratio]; engineering estimate: drawing of a shaft, without the
compliance of its flanges."""
DAMPING_STD = 0.3
"""Standard deviation of a damping [ratio]; engineering estimate: no drawing states it."""
PLAY_STD = 0.3
"""Standard deviation of a play [ratio]; engineering estimate: tolerances and wear of splines."""
EFFICIENCY_STD = 0.01
"""Standard deviation of the efficiency of a gear [-]; engineering estimate."""
DRAG_STD = 0.3
"""Standard deviation of the level of a drag, a loss or a bearing friction [ratio]; engineering
estimate: it changes with the oil temperature."""
TORQUE_MAP_STD = 0.03
"""Standard deviation of the level of an engine map [ratio]; engineering estimate."""
LAG_STD = 0.3
"""Standard deviation of a time constant [ratio]; engineering estimate."""
TYRE_STD = 0.2
"""Standard deviation of the slip stiffness of a tyre [ratio]; engineering estimate: load, pressure,
wear."""
LOAD_STD = 0.1
"""Standard deviation of a constant load [ratio]; engineering estimate."""
ROLLING_STD = 0.2
"""Standard deviation of a rolling resistance [ratio]; engineering estimate: tyre, road,
temperature."""
AERO_STD = 0.2
"""Standard deviation of an aerodynamic coefficient [ratio]; engineering estimate: density of the
air, wind, additions to the body."""

TEETH = re.compile(r"\s*\d{1,6}\s*/\s*\d{1,6}\s*(\*\s*\d{1,6}\s*/\s*\d{1,6}\s*)*")
"""A ratio as tooth counts, `49/33` or `49/33 * 41/20`."""


def describe_ratio(number: float) -> PriorValue:
    """Return the distribution of a ratio by its last written digit.

    1, 1.0 and 1.00 are exact: a direct gear, or no input gear. A whole number counts as written
    with one digit after the point. A number without a text has `GIVEN_DIGITS` digits.

    Parameters
    ----------
    number
        The ratio [-], a `WrittenNumber` where its text is known.
    """
    value = float(number)
    if value == 1.0:
        return PriorValue(value)
    if isinstance(number, WrittenNumber):
        exponent = Decimal(number.text).as_tuple().exponent
        last = min(exponent, -1) if isinstance(exponent, int) else -1
    elif value == int(value):
        last = -1
    else:
        last = math.floor(math.log10(abs(value))) + 1 - GIVEN_DIGITS
    return PriorValue(value, DIGIT_STD * 10.0**last)


def parse_teeth(text: str) -> float:
    """Return the ratio [-] that tooth counts make; it is exact.

    Raises ValueError for another text and for a count of zero.
    """
    if not TEETH.fullmatch(text):
        raise ValueError(f"{text!r} is no ratio of tooth counts; write it as 49/33")
    ratio = 1.0
    for pair in text.split("*"):
        above, below = (int(one) for one in pair.split("/"))
        if above == 0 or below == 0:
            raise ValueError(f"{text!r} has a gear without teeth")
        ratio *= above / below
    return ratio


def describe_fill_pressure(value: float) -> PriorValue:
    """Return the distribution of a P0 [Pa] without a stated standard deviation."""
    return PriorValue(value, FILL_PRESSURE_STD)


def describe_inertia(value: float) -> PriorValue:
    """Return the distribution of an inertia [kg m^2] without a stated standard deviation; zero,
    which means that there is no such member, is exact."""
    return PriorValue(value, INERTIA_STD * abs(value))


def describe_gain(value: float) -> PriorValue:
    """Return the distribution of a gain [m^3] without a stated standard deviation."""
    return PriorValue(value, GAIN_STD * value)


def describe_assumed_gain(value: float) -> PriorValue:
    """Return the distribution of an assumed gain [m^3] without a stated standard deviation."""
    return PriorValue(value, ASSUMED_GAIN_STD * value, assumed=True)


def describe_wheel_radius(value: float) -> PriorValue:
    """Return the distribution of a wheel radius [m] without a stated standard deviation."""
    return PriorValue(value, WHEEL_RADIUS_STD * value)


def describe_partner_level(*gains: PriorValue) -> PriorValue:
    """Return the distribution of the friction of an element that the log does not determine, over
    that of its partner [-], for the values of their `gains` [m^3].

    The log determines the partner's μ·gain, so that the errors of both gains are errors of the
    level.
    """
    return PriorValue(1.0, math.hypot(PARTNER_LEVEL_STD, *(one.std / one.value for one in gains)))


def multiply(*factors: PriorValue) -> PriorValue:
    """Return the product of independent quantities, to first order."""
    value = math.prod(one.value for one in factors)
    relative = math.hypot(*(one.std / one.value for one in factors))
    return PriorValue(value, abs(value) * relative)
