# SPDX-License-Identifier: MIT
"""Fields of the elements of a network as the core states them, and faults of form by them.

The core refuses what is physically impossible; here the form is checked, all elements at once.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from enum import StrEnum
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from drivetwin._native import element_schema
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.simulation.serialize import format_value, is_number

GROUND = "ground"
"""The node or member that does not turn: the housing."""


class FieldKind(StrEnum):
    """Kind of the content of a field."""

    NODE = "node"
    INPUT = "input"
    TEXT = "text"
    FLAG = "flag"
    NUMBER = "number"
    NUMBERS = "numbers"
    ROWS = "rows"
    GROUP = "group"


class Limit(NamedTuple):
    """Range of a number, None where it has no such bound, and values that are refused."""

    least: float | None
    above: float | None
    most: float | None
    excluded: tuple[float, ...]

    def describe(self) -> str:
        """Return the range as documents state it, empty if any number is accepted."""
        bounds = [("≥", self.least), (">", self.above), ("≤", self.most)]
        bounds += (("≠", value) for value in self.excluded)
        return ", ".join(f"{sign} {value:g}" for sign, value in bounds if value is not None)

    def holds(self, value: float) -> bool:
        """Return True if a number is in the range."""
        return (
            (self.least is None or value >= self.least)
            and (self.above is None or value > self.above)
            and (self.most is None or value <= self.most)
            and value not in self.excluded
        )


class Field(NamedTuple):
    """Field of an element or group.

    `absent` is the meaning of a missing optional field, `default` the value that the builder takes.
    `differentiable` is True where the core differentiates by the number. A group has the
    alternatives of its fields.
    """

    kind: FieldKind
    required: bool
    absent: str | None
    default: float | str | None
    differentiable: bool
    unit: str
    limit: Limit | None
    choices: tuple[str, ...]
    group: tuple[Mapping[str, Field], ...]
    help: str


class ElementType(NamedTuple):
    """Type of elements: noun phrase, law, fields beside `type` and `name`."""

    help: str
    law: str
    fields: Mapping[str, Field]


def _read_fields(fields: Sequence[Mapping[str, Any]]) -> dict[str, Field]:
    return {one["name"]: _read_field(one) for one in fields}


def _read_field(one: Mapping[str, Any]) -> Field:
    limit = one["limit"]
    return Field(
        kind=FieldKind(one["kind"]),
        required=one["required"],
        absent=one["absent"],
        default=one["default"],
        differentiable=one["differentiable"],
        unit=one["unit"],
        limit=limit and Limit(limit["least"], limit["above"], limit["most"], tuple(limit["not"])),
        choices=tuple(one["choices"]),
        group=tuple(map(_read_fields, one["alternatives"])),
        help=one["help"],
    )


ELEMENT_TYPES: Mapping[str, ElementType] = {
    one["type"]: ElementType(one["help"], one["law"], _read_fields(one["fields"]))
    for one in json.loads(element_schema())
}
"""Types of elements in the order of the documentation."""
ELEMENT_FIELDS: Mapping[str, Mapping[str, Field]] = {
    kind: one.fields for kind, one in ELEMENT_TYPES.items()
}
"""Fields beside `type` and `name` of every type of element."""


def find_element_faults(elements: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return all faults of form: types, names, missing, unknown and unreadable fields."""
    faults: list[str] = []
    names: set[str] = set()
    for place, element in enumerate(elements):
        if not isinstance(element, Mapping):
            faults.append(f"element {place}: {format_value(element)} is no mapping")
            continue
        name = element.get("name")
        if not isinstance(name, str) or not name:
            faults.append(f"element {place}: missing field 'name', a text")
            name = f"element {place}"
        elif name in names:
            faults.append(f"{name}: two elements have this name")
        names.add(name)
        kind = element.get("type")
        if kind not in ELEMENT_FIELDS:
            hint = suggest_spelling(str(kind), ELEMENT_FIELDS)
            faults.append(f"{name}: unknown type {kind!r}{hint}")
            continue
        given = {key: value for key, value in element.items() if key not in ("type", "name")}
        faults += (f"{name}: {fault}" for fault in _find_faults(given, ELEMENT_FIELDS[str(kind)]))
    return faults


def iterate_out_of_range(
    given: Mapping[str, Any], fields: Mapping[str, Field]
) -> Iterator[tuple[str, float, Limit]]:
    """Yield key, value and range of each number that the core would refuse.

    `given` are sound in form, see `find_element_faults`.
    """
    for key, value in given.items():
        field = fields.get(key)
        if field is None:
            continue
        if isinstance(value, Mapping):
            inner = next((one for one in field.group if value.keys() <= one.keys()), {})
            for path, number, limit in iterate_out_of_range(value, inner):
                yield f"{key}.{path}", number, limit
        elif field.limit is not None:
            for each in np.ravel(value).tolist() if isinstance(value, list | tuple) else [value]:
                if is_number(each) and not field.limit.holds(each):
                    yield key, float(each), field.limit


def refuse_faults(faults: Sequence[str]) -> None:
    """Raise InputError with all faults, if there are any."""
    if faults:
        raise InputError("\n".join(faults), "correct the description of the driveline")


def list_ports(element: Mapping[str, Any]) -> dict[str, str]:
    """Ports of an element, each with its node."""
    fields = ELEMENT_FIELDS[element["type"]]
    nodes = (key for key, one in fields.items() if one.kind is FieldKind.NODE)
    return {key: element[key] for key in nodes if element.get(key) is not None}


def list_inputs(element: Mapping[str, Any]) -> list[str]:
    """Inputs of an element, by the names of its fields in their order."""
    return list(_iterate_inputs(element, ELEMENT_FIELDS[element["type"]]))


def _iterate_inputs(given: Mapping[str, Any], fields: Mapping[str, Field]) -> Iterator[str]:
    for key, one in fields.items():
        if one.kind is FieldKind.INPUT:
            yield given[key]
        elif one.kind is FieldKind.GROUP and given.get(key) is not None:
            yield from _iterate_inputs(given[key], one.group[0])


def _find_faults(given: Mapping[str, Any], fields: Mapping[str, Field]) -> Iterator[str]:
    for key in given:
        if key not in fields:
            yield f"unknown field {key!r}{suggest_spelling(str(key), fields)}"
    for key, one in fields.items():
        if key not in given or (given[key] is None and not one.required):
            if one.required:
                yield f"missing field '{key}'"
        elif one.kind is FieldKind.GROUP:
            yield from (f"{key}: {fault}" for fault in _find_group_faults(given[key], one))
        elif not _matches(given[key], one.kind):
            yield f"{key} = {format_value(given[key])} is no {_MEANINGS[one.kind]}"


def _find_group_faults(given: object, field: Field) -> list[str]:
    """Faults by the alternative that shares most fields."""
    if is_dataclass(given) and not isinstance(given, type):
        given = vars(given)
    if not isinstance(given, Mapping):
        return [f"{format_value(given)} is no mapping of {', '.join(field.group[0])}"]
    best = max(field.group, key=lambda fields: len(set(fields) & set(given)))
    return list(_find_faults(given, best))


_MEANINGS = {
    FieldKind.NODE: "name of a node",
    FieldKind.INPUT: "name of an input",
    FieldKind.TEXT: "text",
    FieldKind.FLAG: "truth value",
    FieldKind.NUMBER: "finite number",
    FieldKind.NUMBERS: "list of finite numbers",
    FieldKind.ROWS: "list of rows of finite numbers",
}


def _matches(value: Any, kind: FieldKind) -> bool:
    match kind:
        case FieldKind.NODE | FieldKind.INPUT | FieldKind.TEXT:
            return isinstance(value, str) and bool(value)
        case FieldKind.FLAG:
            return isinstance(value, bool | np.bool_)
        case FieldKind.NUMBER:
            return (isinstance(value, float) and isfinite(value)) or is_number(value)
        case FieldKind.NUMBERS:
            return _is_list(value) and all(map(is_number, value))
        case _:
            return _is_list(value) and all(_matches(row, FieldKind.NUMBERS) for row in value)


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim > 0)
