# SPDX-License-Identifier: MIT
"""Design data of a vehicle in SI: ratios, shift elements, plausible ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from drivetwin.actuator.model import ActuatorModel

ElementKind = Literal["brake", "clutch"]
Pair = tuple[float, float]
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
class SensorTolerance:
    """One standard deviation of a sensor's constant errors.

    `gain` is relative, `offset` in SI; `age` [s] is how much older values are than their stamps.
    """

    gain: float = 0.0
    offset: float = 0.0
    age: float = 0.0


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
