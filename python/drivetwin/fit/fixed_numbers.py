# SPDX-License-Identifier: MIT
"""Numbers of a network that are not unknowns: their distributions, and the moves within these.

Zero means that a member or an effect is absent, and is exact. One is exact where it is a unit: a
direct gear, no loss, a capacity that is an input.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from enum import StrEnum
from typing import Annotated, Any, cast

import numpy as np
from pydantic import Field

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.fit.number_kinds import USUAL, UsualDeviation
from drivetwin.fit.unknown import ASCII_UNITS
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, FieldKind
from drivetwin.simulation.element_schema import Field as ElementField
from drivetwin.simulation.serialize import is_number
from drivetwin.simulation.variable import exp
from drivetwin.vehicle.spec import describe_ratio

Place = tuple[int | str, ...]
"""Number of an element, and the keys that lead to a number of it."""


class Source(StrEnum):
    """Source of the standard deviation of a number."""

    DIGITS = "written digits"
    USUAL = "usual"
    STATED = "stated"


@dataclass(frozen=True)
class Tolerance:
    """`[tolerances."PATH"]`: distribution of the numbers at a path that are not unknowns.

    Parameters
    ----------
    std
        Standard deviation of each number at the path, SI. Of a number whose usual deviation is
        relative the logarithm is normal, with the deviation `std` over the number.
    exact
        True for numbers that are exact; the path may then be an element or a group.
    """

    std: Annotated[float, Field(gt=0)] | None = None
    exact: bool = False


@dataclass(frozen=True)
class FixedNumber:
    """Number that is not an unknown: `value` with the standard deviation `std`, SI.

    Its coordinate is the deviation over `std`. `places` are the numbers that it moves; a factor
    that several share has the value 1. `is_relative` is True where the logarithm is normal.
    `source` states where the deviation is from.
    """

    name: str
    value: float
    std: float
    unit: str
    is_relative: bool
    places: tuple[Place, ...]
    source: Source

    @property
    def coordinate(self) -> str:
        """Name of the coordinate in the vector of the unknowns."""
        return f"fixed {self.name}"

    def move(self, number: float, coordinate: float) -> float:
        """Return a number at one of the places, moved by a coordinate."""
        if self.is_relative:
            return exp(self.std / abs(self.value) * coordinate) * number
        return self.std * coordinate + number  # a `WrittenNumber` in front would drop derivatives


class CopiedElements:
    """Elements of a network, each of which is copied before a number of it changes."""

    def __init__(self, elements: Sequence[Mapping[str, Any]]) -> None:
        self.listed: list[Any] = list(elements)
        self._copied: set[int | str] = set()

    def get(self, place: Place) -> float:
        """Return the number at a place."""
        found: Any = self.listed
        for key in place:
            found = found[key]
        return cast("float", found)

    def put(self, place: Place, number: float) -> None:
        """Put a number at a place."""
        index, *keys = place
        if index not in self._copied:
            self.listed[int(index)] = copy.deepcopy(self.listed[int(index)])
            self._copied.add(index)
        found = self.listed[int(index)]
        for key in keys[:-1]:
            found = found[key]
        found[keys[-1]] = number


def list_fixed(
    elements: Sequence[Mapping[str, Any]],
    unknown: Collection[str],
    tolerances: Mapping[str, Tolerance],
) -> list[FixedNumber]:
    """List the numbers of a network that are neither unknown nor exact.

    Parameters
    ----------
    elements
        Elements of the network.
    unknown
        Paths of the unknowns.
    tolerances
        Stated distributions by path.

    Raises
    ------
    InputError
        For a tolerance that is none, or whose path leads to no number.
    """
    _require_sound(elements, tolerances)
    return [
        one
        for index, element in enumerate(elements)
        for one in _list_of_element(index, element, unknown, tolerances)
    ]


def _list_of_element(
    index: int,
    element: Mapping[str, Any],
    unknown: Collection[str],
    tolerances: Mapping[str, Tolerance],
) -> Iterator[FixedNumber]:
    """Yield the fixed numbers of an element, and the factors that some of them share."""
    levels: dict[str, list[Place]] = {}
    kinds = USUAL[str(element["type"])]
    for keys, field, schema, number in iterate_numbers(element):
        usual, path, place = kinds[field], _join(element, keys), (index, *keys)
        if path in unknown or number == 0.0 or (usual.unit and number == 1.0):
            continue
        groups = _iterate_groups(path)
        stated = next((tolerances[one] for one in groups if one in tolerances), None)
        if stated is None and usual.shared:
            levels.setdefault(usual.shared, []).append(place)
        std, source = _find_deviation(number, usual, stated)
        if std > 0.0:
            is_relative = not (usual.absolute or usual.digits)
            unit = schema.unit.translate(ASCII_UNITS)
            yield FixedNumber(path, float(number), std, unit, is_relative, (place,), source)
    for shared, places in levels.items():
        (level,) = {one.level for one in kinds.values() if one.shared == shared}
        name = f"factor of {element['name']}.{shared}"
        yield FixedNumber(name, 1.0, level, "", True, tuple(places), Source.USUAL)


def _join(element: Mapping[str, Any], keys: Place) -> str:
    """Return the path of a number of an element."""
    return ".".join(map(str, (element["name"], *keys)))


def _iterate_groups(path: str) -> Iterator[str]:
    """Yield a path, and those of the groups that it is in, the nearest first."""
    while path:
        yield path
        path = path.rpartition(".")[0]


def _find_deviation(
    number: float, usual: UsualDeviation, stated: Tolerance | None
) -> tuple[float, Source]:
    """Find the standard deviation of a number, SI, and its source; 0 for an exact number."""
    if stated is not None:
        return (0.0 if stated.std is None else stated.std), Source.STATED
    if usual.digits:
        return describe_ratio(number).std, Source.DIGITS
    return usual.absolute or usual.relative * abs(number), Source.USUAL


def make_plain(description: Any) -> Any:
    """Return a description of elements as dictionaries and lists; its numbers keep their text."""
    if is_dataclass(description):
        description = vars(description)
    if isinstance(description, Mapping):
        return {key: make_plain(one) for key, one in description.items()}
    if isinstance(description, np.ndarray):
        description = description.tolist()
    if isinstance(description, list | tuple):
        return [make_plain(one) for one in description]
    return description


def iterate_numbers(element: Mapping[str, Any]) -> Iterator[tuple[Place, str, ElementField, float]]:
    """Yield the keys, the path of the field, its schema and the value of each number of an
    element."""
    fields = ELEMENT_FIELDS[str(element["type"])]
    waiting: list[tuple[Place, str, ElementField, Any]] = [
        ((name,), name, one, element.get(name)) for name, one in fields.items()
    ]
    while waiting:
        keys, field, one, value = waiting.pop(0)
        if value is None:
            continue
        if one.kind is FieldKind.GROUP:
            inner = next((each for each in one.group if set(value) <= set(each)), one.group[0])
            waiting += [
                ((*keys, name), f"{field}.{name}", each, value.get(name))
                for name, each in inner.items()
            ]
        else:
            yield from (((*keys, *at), field, one, each) for at, each in _iterate_cells(value))


def _iterate_cells(value: Any) -> Iterator[tuple[Place, float]]:
    """Yield the keys and the value of a number, or of each one of a list or table."""
    if isinstance(value, list | tuple):
        for k, each in enumerate(value):
            yield from (((k, *keys), number) for keys, number in _iterate_cells(each))
    elif is_number(value):
        yield (), value


def _require_sound(
    elements: Sequence[Mapping[str, Any]], tolerances: Mapping[str, Tolerance]
) -> None:
    """Raise InputError for a tolerance that is none, that leads to no number, or whose deviation is
    one of several fields."""
    fields: dict[str, set[str]] = {}
    for element in elements if tolerances else ():
        fields[str(element["name"])] = set()
        for keys, field, *_ in iterate_numbers(element):
            for path in _iterate_groups(_join(element, keys)):
                fields.setdefault(path, set()).add(f"{element['name']}.{field}")
    for path, one in tolerances.items():
        if path not in fields:
            what = f"tolerances.{path}: no number of the model{suggest_spelling(path, fields)}"
            raise InputError(what, "name an element, or a number, list or group of it")
        if (one.std is None) != one.exact:
            raise InputError(f"tolerances.{path} is no distribution", "state std, or exact = true")
        if one.std is not None and not (math.isfinite(one.std) and one.std > 0.0):
            what = f"tolerances.{path}: the standard deviation {one.std:g} is no spread"
            raise InputError(what, "give a positive number, or exact = true")
        if one.std is not None and len(fields[path]) != 1:
            listed = ", ".join(sorted(fields[path]))
            what = f"tolerances.{path}: one standard deviation for {listed or 'no number'}"
            raise InputError(what, "state one for each number, or exact = true")
