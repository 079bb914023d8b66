# SPDX-License-Identifier: MIT
"""Unknowns of a fit: numbers of a network by path, with priors or bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field, PlainSerializer

from drivetwin.errors import InputError
from drivetwin.fit.places import Place, find_place
from drivetwin.parameters import ParameterSpec
from drivetwin.simulation.element_schema import Field as ElementField
from drivetwin.simulation.variable import exp, log

Paths = Mapping[str, float] | Sequence[str] | None
"""Paths of a number, with a factor for each where it is a table; None for its name."""
Bounds = tuple[float | None, float | None]
"""Least and largest value, None where there is none."""


def _read_bounds(stated: object) -> object:
    """Read two numbers of a file; an infinite one leaves its side open."""
    if not isinstance(stated, list):
        return stated
    ends = [one for one in stated if isinstance(one, int | float)]
    if len(ends) == len(stated) == 2 and not ends[0] < ends[1]:
        raise ValueError("bounds are the least and the largest value")
    return tuple(None if one in (-math.inf, math.inf) else one for one in stated)


def _write_bounds(bounds: Bounds) -> list[float]:
    """Write bounds as two numbers of a file."""
    low, high = bounds
    return [-math.inf if low is None else low, math.inf if high is None else high]


@dataclass(frozen=True)
class Unknown:
    """`[unknowns."PATH"]`: a number to be identified.

    Parameters
    ----------
    value
        First guess, and mean of the prior where `std` is stated; SI.
    std
        Standard deviation of the prior, SI; None where nothing is known. That of a positive number
        is relative: its logarithm has the standard deviation `std / value`.
    bounds
        Least and largest value.
    paths
        Paths on which it acts, with a factor for each; None where its name is the path. With
        several paths it is shared: `{"B2.friction.mu_c": 1.0, "B3.friction.mu_c": 1.0}`.
    unit
        SI unit of a number without a path, which acts through expressions alone.
    """

    value: float
    std: Annotated[float, Field(gt=0)] | None = None
    bounds: Annotated[
        Bounds,
        BeforeValidator(_read_bounds, json_schema_input_type=tuple[float, float]),
        PlainSerializer(_write_bounds),
    ] = (None, None)
    paths: Paths = None
    unit: str = ""

    @classmethod
    def read(cls, stated: Unknown | tuple[float, float] | float) -> Unknown:
        """Return an unknown from a first guess, or from a value with its standard deviation."""
        if isinstance(stated, Unknown):
            return stated
        return cls(*stated) if isinstance(stated, Sequence) else cls(stated)


def get_factors(name: str, paths: Paths) -> dict[str, float]:
    """Return the factor of each path on which a number with a name acts."""
    if paths is None:
        return {name: 1.0}
    if isinstance(paths, Mapping):
        return {path: float(factor) for path, factor in paths.items()}
    return dict.fromkeys(paths, 1.0)


class Setting(NamedTuple):
    """Number at a `path` as a function of unknowns: `compute` of their values, in the order of the
    names `of`."""

    path: str
    of: tuple[str, ...]
    compute: Callable[..., float]


@dataclass(frozen=True, eq=False)
class PlacedNumber:
    """Number resolved against a network: it acts on the paths of `factors`.

    `stated` has its value, or mean of the prior, and standard deviation. The coordinate of a number
    that is positive by its law is its logarithm.
    """

    name: str
    stated: Any
    factors: Mapping[str, float]
    is_positive: bool
    spec: ParameterSpec

    @property
    def start(self) -> float:
        """Coordinate of the stated value."""
        return self.to_coordinate(self.stated.value)

    @property
    def spread(self) -> float | None:
        """Standard deviation of the prior of the coordinate; None where nothing is known."""
        std: float | None = self.stated.std
        return std / float(self.stated.value) if std is not None and self.is_positive else std

    def to_coordinate(self, value: float) -> float:
        """Return the coordinate of a value; it carries the derivatives of the value."""
        return log(value) if self.is_positive else value

    def to_value(self, coordinate: float) -> float:
        """Return the value at a coordinate; it carries the derivatives of the coordinate."""
        return exp(coordinate) if self.is_positive else coordinate

    def make_settings(self, of: tuple[str, ...], compute: Callable[..., float]) -> list[Setting]:
        """Return the numbers on which it acts, by a function of the unknowns `of`."""
        return [
            Setting(path, of, compute if factor == 1.0 else partial(_scale, factor, compute))
            for path, factor in self.factors.items()
        ]


@dataclass(frozen=True, eq=False)
class SoughtNumber(PlacedNumber):
    """Unknown resolved against a network: a coordinate of the search."""

    stated: Unknown

    @property
    def settings(self) -> list[Setting]:
        """Numbers on which it acts."""
        return self.make_settings((self.name,), _take)

    @property
    def limits(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        low, high = self.spec.lower, self.spec.upper
        if not self.is_positive:
            return low, high
        return (math.log(low) if low > 0.0 else -math.inf), math.log(high)


def _take(value: float) -> float:
    return value


def _scale(factor: float, compute: Callable[..., float], *values: float) -> float:
    return factor * compute(*values)


def resolve_unknown(
    name: str, unknown: Unknown, places: Mapping[str, Place], *, named: bool = False
) -> SoughtNumber:
    """Resolve an unknown against the numbers of a network.

    An unknown that an expression has `named` needs no path. Raises InputError for a path that leads
    to no number, naming the known ones, for a value beyond its bounds or the limits of the field,
    and for a prior that is no spread.
    """
    factors = get_factors(name, unknown.paths)
    if named and unknown.paths is None and name not in places:
        factors = {}
    if not factors and not named:
        raise InputError(f"{name}: there is no path", "name at least one path that it acts on")
    spec, is_scale = describe_places(name, factors, places, unknown.bounds, unknown.unit)
    is_positive = spec.lower >= 0.0 and unknown.value > 0.0 and is_scale
    found = SoughtNumber(name, unknown, factors, is_positive, spec)
    require_sound(found)
    return found


def describe_places(
    name: str,
    factors: Mapping[str, float],
    places: Mapping[str, Place],
    bounds: Bounds,
    unit: str,
) -> tuple[ParameterSpec, bool]:
    """Describe a number that acts on paths with factors, within bounds; without a path in a `unit`.

    The second value is False where zero is a value like others: of starts, delays and offsets.
    Raises InputError for a path that leads to no number, and for a factor that is none.
    """
    if not all(math.isfinite(factor) and factor != 0.0 for factor in factors.values()):
        raise InputError(f"{name}: a factor is zero or no number", "leave that path out")
    found = [find_place(path, places) for path in factors]
    fields = [(one.schema, factors[one.path]) for one in found]
    low, high = (_bound(bounds[k], fields, k) for k in (0, 1))
    first = fields[0][0] if fields else None
    spec = ParameterSpec(
        stem=name,
        name=name,
        symbol=name,
        unit=(first.unit.translate(ASCII_UNITS) if first else unit) or "1",
        meaning=first.help if first else "",
        lower=low,
        upper=high,
    )
    return spec, not any(one.field in ("start", "delay", "offset") for one in found)


def require_sound(one: PlacedNumber) -> None:
    """Raise InputError for a stated value beyond its bounds, and for a prior that is no spread."""
    given, name, spec = one.stated, one.name, one.spec
    inside = spec.lower <= given.value <= spec.upper and not (
        one.is_positive and given.value == 0.0
    )
    if not (inside and math.isfinite(given.value)):
        what = f"{name}: the value {given.value:g} is outside {spec.lower:g} to {spec.upper:g}"
        raise InputError(what, "correct the value or its bounds")
    if given.std is not None and not (math.isfinite(given.std) and given.std > 0.0):
        what = f"{name}: the standard deviation {given.std:g} is no spread"
        raise InputError(what, "give a positive number, or leave it out where nothing is known")


def _bound(stated: float | None, fields: Sequence[tuple[ElementField, float]], side: int) -> float:
    """Return the bound of a value on one side: the stated one, or a limit of the fields over the
    factor there."""
    limits = [] if stated is None else [float(stated)]
    for field, factor in fields:
        limit = field.limit
        if limit is not None:
            is_lower = (side == 0) == (factor > 0.0)
            ends = (limit.least, limit.above) if is_lower else (limit.most,)
            limits += [end / factor for end in ends if end is not None]
    if side == 0:
        return max(limits, default=-math.inf)
    return min(limits, default=math.inf)


ASCII_UNITS = str.maketrans({"·": "*", "²": "^2", "³": "^3"})
"""Spelling of the units of the parameter table."""


def require_distinct_places(acting: Mapping[str, Iterable[str]]) -> None:
    """Raise InputError for a path on which two unknowns or expressions act; paths by name."""
    owners: dict[str, str] = {}
    for name, paths in acting.items():
        for path in paths:
            if path in owners:
                what = f"{path}: set by {owners[path]!r} and {name!r}"
                raise InputError(what, "leave the path to one of them")
            owners[path] = name
