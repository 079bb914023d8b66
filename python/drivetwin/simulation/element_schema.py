# SPDX-License-Identifier: MIT
"""Fields of the elements of a network, and the faults of descriptions by them.

The core refuses what is physically impossible; here the form is checked, all elements at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from enum import Enum, auto
from typing import Any

import numpy as np

from drivetwin._util.spelling import suggest_spelling
from drivetwin.errors import InputError
from drivetwin.simulation.serialize import format_value, is_number

GROUND = "ground"


class FieldKind(Enum):
    """Kind of the content of a field."""

    NODE = auto()
    INPUT = auto()
    TEXT = auto()
    FLAG = auto()
    NUMBER = auto()
    NUMBERS = auto()
    ROWS = auto()
    GROUP = auto()


@dataclass(frozen=True)
class Field:
    """A field of an element or group; a group has the alternatives of its fields."""

    kind: FieldKind
    required: bool = True
    group: tuple[Mapping[str, Field], ...] = ()


_NODE, _INPUT = Field(FieldKind.NODE), Field(FieldKind.INPUT)
_NUMBER, _NUMBERS = Field(FieldKind.NUMBER), Field(FieldKind.NUMBERS)
_OPTIONAL = replace(_NUMBER, required=False)
_ENDS = {"a": _NODE, "b": _NODE}
_STRIBECK = dict.fromkeys(("mu_c", "mu_s", "v_s", "mu_v"), _NUMBER)
_TABLE = {"slip": _NUMBERS, "mu": _NUMBERS, "extend": Field(FieldKind.FLAG, required=False)}
_FRICTION = Field(FieldKind.GROUP, group=(_STRIBECK, _TABLE))
_LAW = {"friction": _FRICTION, "gain": _NUMBER, "p0": _NUMBER, "peak": _NUMBER, "pressure": _INPUT}
_LOSS = {
    "law": Field(FieldKind.TEXT),
    "eta": _NUMBER,
    **dict.fromkeys(("eta_backward", "drag", "drag_backward"), _OPTIONAL),
}
_LOSSES = {"speed": _NUMBERS, "torque": _NUMBERS, "loss": Field(FieldKind.ROWS)}
_DRAG = {"slip": _NUMBERS, "torque": _NUMBERS}
_CONVERTER = dict.fromkeys(("speed_ratio", "capacity", "torque_ratio"), _NUMBERS)
_ENGINE = {"throttle": _NUMBERS, "speed": _NUMBERS, "torque": Field(FieldKind.ROWS)}


def _group(fields: Mapping[str, Field], *, required: bool = True) -> Field:
    return Field(FieldKind.GROUP, required, (fields,))


ELEMENT_FIELDS: Mapping[str, Mapping[str, Field]] = {
    "inertia": {"node": _NODE, "inertia": _NUMBER},
    "gear": {
        **_ENDS,
        "ratio": _NUMBER,
        "loss": _group(_LOSS, required=False),
        "losses": _group(_LOSSES, required=False),
    },
    "planetary": {
        **dict.fromkeys(("sun", "ring", "carrier"), _NODE),
        "z": _NUMBER,
        "planet_inertia": _OPTIONAL,
        "losses": _group(_LOSSES, required=False),
    },
    "clutch": {
        **_ENDS,
        **_LAW,
        "drum_inertia": _NUMBER,
        "drag": _group(_DRAG, required=False),
    },
    "one_way_clutch": {**_ENDS, "clutch": _group(_LAW, required=False)},
    "bearing": {**_ENDS, "speed": _NUMBERS, "torque": _NUMBERS, "peak": _NUMBER},
    "spring_damper": {**_ENDS, "stiffness": _NUMBER, "damping": _NUMBER},
    "spring_table": {**_ENDS, "twist": _NUMBERS, "torque": _NUMBERS, "damping": _NUMBER},
    "backlash": {**_ENDS, "stiffness": _NUMBER, "damping": _NUMBER, "gap": _NUMBER},
    "torque_converter": {"pump": _NODE, "turbine": _NODE, "map": _group(_CONVERTER)},
    "tyre": {**_ENDS, "slip_stiffness": _NUMBER, "least_speed": _NUMBER},
    "road_load": {"node": _NODE, "constant": _NUMBER, "rolling": _NUMBER, "aero": _NUMBER},
    "torque": {"node": _NODE, "reaction": replace(_NODE, required=False), "input": _INPUT},
    "engine_map": {
        **{"node": _NODE, "throttle": _INPUT, "map": _group(_ENGINE)},
        "lag": _OPTIONAL,
    },
    "prescribed_speed": {"node": _NODE, "input": _INPUT},
}
"""Fields beside `type` and `name` of every type of element, in the order of the documentation."""


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
            return is_number(value)
        case FieldKind.NUMBERS:
            return _is_list(value) and all(map(is_number, value))
        case _:
            return _is_list(value) and all(_matches(row, FieldKind.NUMBERS) for row in value)


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple) or (isinstance(value, np.ndarray) and value.ndim > 0)
