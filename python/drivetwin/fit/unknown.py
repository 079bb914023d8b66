# SPDX-License-Identifier: MIT
"""Unknowns of a fit: numbers of a network by path, with priors or bounds."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.parameters import ParameterSpec
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, FieldKind
from drivetwin.simulation.element_schema import Field as ElementField

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
    """

    value: float
    std: Annotated[float, Field(gt=0)] | None = None
    bounds: Annotated[
        Bounds, BeforeValidator(_read_bounds, json_schema_input_type=tuple[float, float])
    ] = (None, None)
    paths: Mapping[str, float] | Sequence[str] | None = None

    @classmethod
    def read(cls, stated: Unknown | tuple[float, float] | float) -> Unknown:
        """Return an unknown from a first guess, or from a value with its standard deviation."""
        if isinstance(stated, Unknown):
            return stated
        return cls(*stated) if isinstance(stated, Sequence) else cls(stated)

    def get_factors(self, name: str) -> dict[str, float]:
        """Return the factor of each path of the unknown with this name."""
        if self.paths is None:
            return {name: 1.0}
        if isinstance(self.paths, Mapping):
            return {path: float(factor) for path, factor in self.paths.items()}
        return dict.fromkeys(self.paths, 1.0)


@dataclass(frozen=True)
class SoughtNumber:
    """Unknown resolved against a network: a coordinate of the search.

    A number that is positive by its law is sought by its logarithm. `factors` are those of its
    paths.
    """

    name: str
    unknown: Unknown
    factors: Mapping[str, float]
    is_positive: bool
    spec: ParameterSpec

    @property
    def start(self) -> float:
        """Coordinate of the first guess."""
        return self.to_coordinate(self.unknown.value)

    @property
    def spread(self) -> float | None:
        """Standard deviation of the prior of the coordinate; None where nothing is known."""
        std = self.unknown.std
        return std if std is None or not self.is_positive else std / self.unknown.value

    @property
    def limits(self) -> tuple[float, float]:
        """Bounds of the coordinate."""
        low, high = self.spec.lower, self.spec.upper
        if not self.is_positive:
            return low, high
        return (math.log(low) if low > 0.0 else -math.inf), math.log(high)

    def to_coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        return math.log(value) if self.is_positive else value

    def to_value(self, coordinate: float) -> float:
        """Return the value at a coordinate."""
        return math.exp(coordinate) if self.is_positive else coordinate


def resolve_unknown(
    name: str, unknown: Unknown, elements: Sequence[Mapping[str, Any]]
) -> SoughtNumber:
    """Resolve an unknown against the elements of a network.

    Raises InputError for a path that leads to no number, naming the known ones, for a value beyond
    its bounds or the limits of the field, and for a prior that is no spread.
    """
    factors = unknown.get_factors(name)
    if not factors:
        raise InputError(f"{name}: there is no path", "name at least one path that it acts on")
    if not all(math.isfinite(factor) and factor != 0.0 for factor in factors.values()):
        raise InputError(f"{name}: a factor is zero or no number", "leave that path out")
    found_fields = {path: _find_field(path, elements) for path in factors}
    fields = [(one, factors[path]) for path, one in found_fields.items() if one is not None]
    low, high = (_bound(unknown.bounds[k], fields, k) for k in (0, 1))
    first = fields[0][0] if fields else None
    spec = ParameterSpec(
        stem=name,
        name=name,
        symbol=name,
        unit=_get_unit(next(iter(factors)), first),
        meaning=first.help if first else "",
        lower=low,
        upper=high,
    )
    is_positive = low >= 0.0 and unknown.value > 0.0 and bool(fields)
    found = SoughtNumber(name, unknown, factors, is_positive, spec)
    _require_sound(found)
    return found


def _require_sound(one: SoughtNumber) -> None:
    given, name, spec = one.unknown, one.name, one.spec
    if not math.isfinite(given.value) or not spec.lower <= given.value <= spec.upper:
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


def _get_unit(path: str, first: ElementField | None) -> str:
    if first is not None:
        return first.unit.translate(ASCII_UNITS) or "1"
    return "s" if path.startswith("delay.") else "1"


def _find_field(path: str, elements: Sequence[Mapping[str, Any]]) -> ElementField | None:
    """Return the field of the number at a path; None for a start or a delay."""
    head, *names = path.split(".")
    if head in ("start", "delay"):
        return None
    by_name = {str(one["name"]): one for one in elements}
    if head not in by_name:
        hint = suggest_spelling(head, by_name)
        raise InputError(f"{path}: no element {head!r}{hint}", f"known are {', '.join(by_name)}")
    place: Any = by_name[head]
    fields: Mapping[str, ElementField] = ELEMENT_FIELDS[str(place["type"])]
    found: ElementField | None = None
    for name in names:
        if isinstance(place, list | tuple):
            place = place[int(name)] if name.isdecimal() and int(name) < len(place) else None
            continue
        known = _list_numbers(fields, place)
        if not isinstance(place, Mapping) or name not in fields or name not in place:
            hint = suggest_spelling(name, known)
            raise InputError(f"{path}: no field {name!r}{hint}", f"known are {', '.join(known)}")
        found, place = fields[name], place[name]
        if found.kind is FieldKind.GROUP:
            keys = set(place)
            fields = next((one for one in found.group if keys <= set(one)), found.group[0])
    if not isinstance(place, int | float) or found is None:
        listed = ", ".join(_list_numbers(fields, place))
        remedy = f"known are {listed}" if listed else "name a field with a number, or its place"
        raise InputError(f"{path} is no number", remedy)
    return found


def require_distinct_places(sought: Iterable[SoughtNumber]) -> None:
    """Raise InputError for a number that two unknowns set."""
    owners: dict[str, str] = {}
    for one in sought:
        for path in one.factors:
            if path in owners:
                what = f"{path}: set by the unknowns {owners[path]!r} and {one.name!r}"
                raise InputError(what, "leave the path to one of them")
            owners[path] = one.name


def require_known_places(
    sought: Iterable[SoughtNumber], starts: Collection[str], inputs: Collection[str]
) -> None:
    """Raise InputError for an unknown start or delay of a name that the network does not have."""
    known = {"start": ("node or shaft", starts), "delay": ("input", inputs)}
    for path in (path for one in sought for path in one.factors):
        head, _, name = path.partition(".")
        what, names = known.get(head, ("", ()))
        if what and name not in names:
            hint = suggest_spelling(name, names)
            listed = ", ".join(names)
            raise InputError(f"{path}: the model has no {what} {name!r}{hint}", f"known: {listed}")


def _list_numbers(fields: Mapping[str, ElementField], place: Any) -> list[str]:
    """List the fields of an element or group that hold numbers, or groups of them."""
    if not isinstance(place, Mapping):
        return []
    wanted = (FieldKind.NUMBER, FieldKind.NUMBERS, FieldKind.ROWS, FieldKind.GROUP)
    return [name for name, one in fields.items() if one.kind in wanted and name in place]
