# SPDX-License-Identifier: MIT
"""Functions of unknowns: numbers of a network, derived values, and priors on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field
from pydantic.json_schema import SkipJsonSchema

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.fit.formula import Formula, parse_formula
from drivetwin.fit.places import Place
from drivetwin.fit.unknown import (
    Paths,
    PlacedNumber,
    Setting,
    SoughtNumber,
    Unknown,
    describe_places,
    get_factors,
    require_distinct_places,
    require_sound,
    resolve_unknown,
)
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.simulation.variable import Variable


@dataclass(frozen=True)
class Expression:
    """`[expressions."PATH"]`: number that is a function of unknowns.

    Parameters
    ----------
    formula
        Text such as `Je / eta`; in Python also a function of the numbers `of`, built from `+`, `-`,
        `*`, `/`, `**` and `exp`, `log` of `drivetwin.simulation.variable`.
    of
        Names of the unknowns that a function of Python takes, in their order.
    paths
        Paths on which it acts, as those of an unknown: its name where None; an empty list for a
        value that is only reported.
    value, std
        Prior of the number, SI. That of a number that is positive by its law is relative, as of an
        unknown.
    unit
        Unit of a number without a path, in SI.
    """

    formula: str | SkipJsonSchema[Callable[..., float]]
    of: SkipJsonSchema[Sequence[str]] = ()
    paths: Paths = None
    value: float | None = None
    std: Annotated[float, Field(gt=0)] | None = None
    unit: str = ""


@dataclass(frozen=True, eq=False)
class DerivedNumber(PlacedNumber):
    """Expression resolved against a network: a `function` of unknowns, its `arguments`."""

    arguments: tuple[SoughtNumber, ...]
    function: Callable[..., float]

    @property
    def settings(self) -> list[Setting]:
        """Numbers on which it acts."""
        return self.make_settings(tuple(one.name for one in self.arguments), self.compute)

    def compute(self, *values: float) -> float:
        """Compute the number of the values of its arguments; NaN where it has none."""
        try:
            found = self.function(*values)
        except (ArithmeticError, ValueError):
            return math.nan
        return math.nan if isinstance(found, complex) else found

    def evaluate(self, point: ParameterVector) -> float:
        """Compute the number at a point of the unknowns."""
        return self.compute(*(one.to_value(point[one.name]) for one in self.arguments))

    def linearise(self, point: ParameterVector) -> tuple[float, FloatArray]:
        """Compute the coordinate of the number and its derivatives (p,) by those of a point."""
        found = self.evaluate(point.to_variables())
        found = math.nan if self.is_positive and not found > 0.0 else self.to_coordinate(found)
        slopes = found.slopes if isinstance(found, Variable) else np.zeros(len(point.names))
        return float(found), slopes


class ResolvedNumbers(NamedTuple):
    """Unknowns of a network, and the functions of them."""

    sought: list[SoughtNumber]
    derived: list[DerivedNumber]

    @property
    def acting(self) -> list[SoughtNumber | DerivedNumber]:
        """Unknowns and functions."""
        return [*self.sought, *self.derived]

    @property
    def settings(self) -> list[Setting]:
        """Numbers of the network that are set."""
        return [each for one in self.acting for each in one.settings]


def resolve_numbers(
    unknowns: Mapping[str, Unknown],
    expressions: Mapping[str, Expression],
    places: Mapping[str, Place],
    beside: Collection[str] = (),
) -> ResolvedNumbers:
    """Resolve the unknowns of a network and the functions of them.

    Unknowns named in `beside` need no path: something else than the network depends on them.
    Raises InputError for a path that leads to no number, for two that set the same one, and for an
    expression that is none.
    """
    formulas = {name: _read_formula(name, one, unknowns) for name, one in expressions.items()}
    named = {*beside, *(name for one in formulas.values() for name in one.of)}
    sought = [
        resolve_unknown(name, one, places, named=name in named) for name, one in unknowns.items()
    ]
    by_name = {one.name: one for one in sought}
    derived = [
        _resolve_expression(name, one, formulas[name], by_name, places)
        for name, one in expressions.items()
    ]
    found = ResolvedNumbers(sought, derived)
    require_distinct_places({one.name: one.factors for one in found.acting})
    return found


def _read_formula(name: str, one: Expression, unknowns: Mapping[str, Unknown]) -> Formula:
    if name in unknowns:
        raise InputError(f"{name}: an unknown and an expression", "leave one of them out")
    if isinstance(one.formula, str):
        return parse_formula(name, one.formula, unknowns)
    for each in one.of:
        if each not in unknowns:
            hint = suggest_spelling(each, unknowns)
            raise InputError(f"{name}: {each!r} is no unknown{hint}", "name unknowns in 'of'")
    return Formula(tuple(one.of), one.formula)


def _resolve_expression(
    name: str,
    one: Expression,
    formula: Formula,
    sought: Mapping[str, SoughtNumber],
    places: Mapping[str, Place],
) -> DerivedNumber:
    factors = get_factors(name, one.paths)
    spec, is_scale = describe_places(name, factors, places, (None, None), one.unit)
    arguments = tuple(sought[each] for each in formula.of)
    found = DerivedNumber(name, one, factors, False, spec, arguments, formula.compute)
    point = ParameterVector(formula.of, np.array([each.start for each in arguments]))
    value, slopes = found.linearise(point)
    if not (spec.lower <= value <= spec.upper and np.all(np.isfinite(slopes))):
        what = (
            f"{name}: {value:g} at the first guesses, not within {spec.lower:g} to {spec.upper:g}"
        )
        raise InputError(what, "correct the formula, or the first guesses of its unknowns")
    _require_derivatives(found, point, slopes)
    found = replace(found, is_positive=is_scale and spec.lower >= 0.0 and value > 0.0)
    if (one.value is None) != (one.std is None):
        raise InputError(f"{name}: a prior has value and std", "state both, or none")
    if one.value is not None:
        require_sound(found)
    return found


_STEP, _AGREEMENT = 1e-6, 1e-3
"""Step of a difference [ratio], and its disagreement with a derivative that is wrong [ratio]."""


def _require_derivatives(found: DerivedNumber, point: ParameterVector, slopes: FloatArray) -> None:
    """Raise InputError for a function that loses the derivatives of its arguments, as one of the
    module `math`."""
    steps = np.diag(_STEP * np.maximum(np.abs(point.values), 1.0))
    for name, step, slope in zip(point.names, steps, slopes.tolist(), strict=True):
        ends = [found.evaluate(point.replace_values(point.values + s)) for s in (step, -step)]
        there = (ends[0] - ends[1]) / (2.0 * step.sum())
        size = max(abs(slope), abs(there), _AGREEMENT * abs(ends[0]))
        if abs(slope - there) > _AGREEMENT * size:
            what = f"{found.name}: the derivative by {name!r} is {slope:g}, not {there:g}"
            raise InputError(what, "take exp and log from drivetwin.simulation.variable")


@dataclass(frozen=True, eq=False)
class RowPrior(Prior):
    """Prior `base` of the coordinates `names`, and a row for each prior of a function of them.

    The precision contains the rows as linearised last; cost and gradient are exact.
    """

    base: Prior
    names: tuple[str, ...]
    rows: Sequence[DerivedNumber]

    def append(self, value: float, std: float) -> Prior:
        """Copy the prior with one more coordinate, independent of the others."""
        wider = super().append(value, std)
        return replace(
            self, mean=wider.mean, precision=wider.precision, base=self.base.append(value, std)
        )

    def linearise(self, theta: FloatArray) -> Prior:
        """Copy the prior with the rows linearised at `theta` (p,)."""
        _, slopes = self._compute_rows(theta)
        return replace(self, precision=self.base.precision + slopes.T @ slopes)

    def compute_gradient(self, theta: FloatArray) -> FloatArray:
        """Half the derivative (p,) of the cost at `theta` (p,)."""
        residual, slopes = self._compute_rows(theta)
        return self.base.compute_gradient(theta) + residual @ slopes

    def compute_prior_cost(self, theta: FloatArray) -> float:
        """Cost at `theta` (p,); infinite where a function has no value."""
        residual, _ = self._compute_rows(theta)
        cost = self.base.compute_prior_cost(theta) + float(residual @ residual)
        return cost if math.isfinite(cost) else math.inf

    def _compute_rows(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the normalised rows (r,) and their derivatives (r, p)."""
        point = ParameterVector(self.names, theta[: len(self.names)])
        residual, slopes = np.zeros(len(self.rows)), np.zeros((len(self.rows), theta.size))
        for k, one in enumerate(self.rows):
            found, by = one.linearise(point)
            std = one.spread or math.nan
            residual[k], slopes[k, : by.size] = (found - one.start) / std, by / std
        return residual, slopes


def add_rows(prior: Prior, point: ParameterVector, derived: Sequence[DerivedNumber]) -> Prior:
    """Return a prior with the rows of the functions that have one, linearised at a point."""
    rows = [one for one in derived if one.spread is not None]
    if not rows:
        return prior
    found = RowPrior(prior.mean, prior.precision, prior, point.names, rows)
    return found.linearise(point.values)
