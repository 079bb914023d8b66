# SPDX-License-Identifier: MIT
"""Distribution of a number as a person writes it: the only place that makes one.

People round as well as cut. The true ratio is therefore uniform within one unit of the last written
digit to either side, which has a standard deviation of 2/√12 = 0.58 of a unit. Digits say nothing
about pressures, inertias and radii; their standard deviations are engineering estimates without a
published source.
"""

from __future__ import annotations

import math
import re
from decimal import Decimal

from drivetwin._util.toml import WrittenNumber
from drivetwin.channels.units import BAR
from drivetwin.vehicle.spec import PriorValue

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
ASSUMED_GAIN_STD = 0.2
"""Standard deviation of a gain that is assumed from a usual μ [ratio]; engineering estimate: μ of a
paper lining from 0.09 to 0.15, and the error of the product of μ and gain from a log."""
PARTNER_LEVEL_STD = 0.07
"""Standard deviation of the friction of an element that the log does not determine, over that of
its partner [ratio]; engineering estimate for two clutches with the same lining and oil."""
PARTNER_REST_STD = 0.015
"""Standard deviation of the rise of friction to zero slip of such an element beyond that of its
partner [-]; engineering estimate."""

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


def describe_assumed_gain(value: float) -> PriorValue:
    """Return the distribution of an assumed gain [m^3] without a stated standard deviation."""
    return PriorValue(value, ASSUMED_GAIN_STD * value, assumed=True)


def describe_wheel_radius(value: float) -> PriorValue:
    """Return the distribution of a wheel radius [m] without a stated standard deviation."""
    return PriorValue(value, WHEEL_RADIUS_STD * value)


def multiply(*factors: PriorValue) -> PriorValue:
    """Return the product of independent quantities, to first order."""
    value = math.prod(one.value for one in factors)
    relative = math.hypot(*(one.std / one.value for one in factors))
    return PriorValue(value, abs(value) * relative)
