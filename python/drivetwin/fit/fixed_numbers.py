# SPDX-License-Identifier: MIT
"""Numbers of a network that are not unknowns: their distributions, and the moves within these.

Zero means that a member or an effect is absent, and is exact. One is exact where it is a unit: a
direct gear, no loss, a capacity that is an input.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from enum import StrEnum
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from drivetwin.errors import InputError, suggest_spelling
from drivetwin.fit.number_kinds import UsualDeviation
from drivetwin.fit.places import Keys, Place
from drivetwin.fit.unknown import ASCII_UNITS
from drivetwin.simulation.variable import exp
from drivetwin.vehicle.spec import describe_ratio


class Source(StrEnum):
    """Source of the standard deviation of a number."""

    DIGITS = "written digits"
    USUAL = "usual"
    STATED = "stated"
    OMITTED = "omitted"


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
    places: tuple[Keys, ...]
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


def list_fixed(
    elements: Sequence[Mapping[str, Any]],
    places: Mapping[str, Place],
    unknown: Collection[str],
    tolerances: Mapping[str, Tolerance],
) -> list[FixedNumber]:
    """List the numbers of a network and its channels that are neither unknown nor exact.

    Parameters
    ----------
    elements
        Elements of the network.
    places
        Its numbers by path. Known starts are not listed: each recording has its own.
    unknown
        Paths of the unknowns.
    tolerances
        Stated distributions by path.

    Raises
    ------
    InputError
        For a tolerance that is none, or whose path leads to no number.
    """
    _require_sound(elements, places, tolerances)
    found: list[FixedNumber] = []
    levels: dict[tuple[Keys, str], list[Place]] = {}
    for path, one in places.items():
        usual, number = one.usual, one.value
        groups = _iterate_groups(path)
        stated = next((tolerances[each] for each in groups if each in tolerances), None)
        is_exact = number == 0.0 or (usual.unit and number == 1.0)
        if path in unknown or one.field == "start" or (is_exact and path not in tolerances):
            continue
        if stated is None and usual.shared:
            levels.setdefault((one.keys[:2], usual.shared), []).append(one)
        std, source = _find_deviation(number, usual, stated)
        if std > 0.0:
            is_absolute = usual.absolute or usual.digits or usual == UsualDeviation()
            is_relative = not is_absolute and number != 0.0
            unit = one.schema.unit.translate(ASCII_UNITS)
            found.append(
                FixedNumber(path, float(number), std, unit, is_relative, (one.keys,), source)
            )
    for (_, index), shared in levels:
        inside = levels[(("elements", index), shared)]
        name = f"factor of {elements[int(index)]['name']}.{shared}"
        keys, level = tuple(one.keys for one in inside), inside[0].usual.level
        found.append(FixedNumber(name, 1.0, level, "", True, keys, Source.USUAL))
    order = {one.keys[:2]: place for place, one in enumerate(places.values())}
    return sorted(found, key=lambda one: order[one.places[0][:2]])


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


def _require_sound(
    elements: Sequence[Mapping[str, Any]],
    places: Mapping[str, Place],
    tolerances: Mapping[str, Tolerance],
) -> None:
    """Raise InputError for a tolerance that is none, that leads to no number, or whose deviation is
    one of several fields."""
    fields: dict[str, set[str]] = {str(one["name"]): set() for one in elements}
    for place in places.values() if tolerances else ():
        of = elements[int(place.keys[1])]["name"] if place.keys[0] == "elements" else place.keys[1]
        for path in _iterate_groups(place.path):
            fields.setdefault(path, set()).add(f"{of}.{place.field}")
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
