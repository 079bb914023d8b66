# SPDX-License-Identifier: MIT
"""Numbers that carry their derivatives by the unknowns of a problem.

A description that is computed from them contains the chain rule: the core reads each number with
the weights of its derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray

Seeded = tuple[float, list[tuple[int, float]]]
"""A number with the lanes and weights of its derivatives, as the core reads it."""


class Variable(float):
    """Number with its derivatives `slopes` (p,) by p unknowns.

    Sums, products, quotients, powers, magnitudes, `exp` and `log` keep the derivatives; comparisons
    are those of the value. Functions of NumPy are refused.
    """

    slopes: FloatArray
    __array_ufunc__ = None  # NumPy's scalars leave the operation to this class

    def __new__(cls, value: float, slopes: FloatArray) -> Variable:
        number = super().__new__(cls, value)
        number.slopes = slopes
        return number

    def __neg__(self) -> Variable:
        return Variable(-float(self), -self.slopes)

    def __abs__(self) -> Variable:
        return -self if self < 0.0 else self

    def __add__(self, other: float) -> Variable:
        return _combine(self, other, float(self) + float(other), 1.0, 1.0)

    __radd__ = __add__

    def __sub__(self, other: float) -> Variable:
        return _combine(self, other, float(self) - float(other), 1.0, -1.0)

    def __rsub__(self, other: float) -> Variable:
        return _combine(self, other, float(other) - float(self), -1.0, 1.0)

    def __mul__(self, other: float) -> Variable:
        return _combine(self, other, float(self) * float(other), float(other), float(self))

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Variable:
        quotient = float(self) / float(other)
        return _combine(self, other, quotient, 1.0 / float(other), -quotient / float(other))

    def __rtruediv__(self, other: float) -> Variable:
        quotient = float(other) / float(self)
        return _combine(self, other, quotient, -quotient / float(self), 1.0 / float(self))

    def __pow__(self, power: float, modulus: None = None) -> Variable:
        del modulus
        base, order = float(self), float(power)
        value = math.pow(base, order)  # no complex number of a negative base
        by_power = value * math.log(base) if isinstance(power, Variable) else 0.0
        return _combine(self, power, value, order * math.pow(base, order - 1.0), by_power)

    def __rpow__(self, base: float, modulus: None = None) -> Variable:
        return Variable(base, 0.0 * self.slopes).__pow__(self, modulus)


def exp(number: float) -> float:
    """Compute the exponential; infinite where it overflows."""
    try:
        value = math.exp(number)
    except OverflowError:
        value = math.inf
    if not isinstance(number, Variable):
        return value
    with np.errstate(invalid="ignore"):  # no slope of an infinite value where the number has none
        return Variable(value, value * number.slopes)


def log(number: float) -> float:
    """Compute the natural logarithm."""
    value = math.log(number)
    return Variable(value, number.slopes / float(number)) if isinstance(number, Variable) else value


def seed(number: float, lanes: Sequence[int]) -> Seeded:
    """Return a number with the derivatives by the unknowns of a pass, by their numbers."""
    if not isinstance(number, Variable):
        return float(number), []
    slopes = number.slopes[lanes].tolist()
    return float(number), [(lane, one) for lane, one in enumerate(slopes) if one != 0.0]


_SEEDED = (Variable, dict, list, tuple)
"""Values of a description that may contain a variable."""


def seed_description(description: Any, lanes: Sequence[int]) -> Any:
    """Return a description of mappings and lists in which each number carries its seeds."""
    if isinstance(description, Variable):
        value, seeds = seed(description, lanes)
        return {"value": value, "seeds": seeds} if seeds else value
    if isinstance(description, dict):
        return dict(zip(description, seed_description([*description.values()], lanes), strict=True))
    if isinstance(description, list | tuple):
        return [
            seed_description(value, lanes) if isinstance(value, _SEEDED) else value
            for value in description
        ]
    return description


def list_variables(description: Any) -> list[Variable]:
    """List the variables of a description of mappings and lists."""
    found: list[Variable] = []
    waiting = [description]
    while waiting:
        one = waiting.pop()
        if isinstance(one, Variable):
            found.append(one)
        elif isinstance(one, dict | list | tuple):
            waiting += one.values() if isinstance(one, dict) else one
    return found


def sign(number: float) -> float:
    """Return the sign of a number: -1, 0 or 1."""
    return float((number > 0.0) - (number < 0.0))


def _combine(one: Variable, other: float, value: float, by_one: float, by_other: float) -> Variable:
    """Return a result with its derivatives by both operands."""
    slopes = by_one * one.slopes
    if isinstance(other, Variable):
        slopes = slopes + by_other * other.slopes
    return Variable(value, np.asarray(slopes))
