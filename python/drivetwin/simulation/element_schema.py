# SPDX-License-Identifier: MIT
"""Fields of the elements of a network as the core states them, faults of form, and values for it.

The core refuses what is physically impossible; here the form is checked, all elements at once.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from enum import StrEnum
from math import isfinite
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivetwin._native import element_schema
from drivetwin.errors import InputError, suggest_spelling

FloatArray = NDArray[np.float64]


def as_json(description: object) -> str:
    """A description, of dataclasses too, as the core reads it.

    Numbers and arrays of NumPy become plain ones. JSON has no NaN, so numbers that are not finite
    are refused by name here: raises InputError, as for anything else that has no place in JSON.
    """
    try:
        return json.dumps(description, default=_to_json_types, allow_nan=False)
    except ValueError:
        pass
    try:
        plain = json.loads(json.dumps(description, default=_to_json_types))
    except ValueError as error:
        raise InputError(f"an integer is too long: {error}", "give numbers in SI") from None
    bad = [key for key, value in _iterate_leaves("", plain) if not np.isfinite(value)]
    raise InputError(
        f"not a finite number: {', '.join(bad)}", "give every parameter of the model a value"
    )


def _to_json_types(value: object) -> object:
    """Convert a value to JSON-serialisable types."""
    if isinstance(value, np.floating):
        return float(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if is_dataclass(value):
        return vars(value)
    if isinstance(value, Mapping):
        return dict(value)
    raise InputError(
        f"{value!r} in the description of a driveline",
        "describe it with numbers, texts, lists and mappings",
    )


def _iterate_leaves(path: str, value: object) -> Iterator[tuple[str, float]]:
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _iterate_leaves(f"{path}.{key}" if path else str(key), item)
    elif isinstance(value, list | tuple):
        for i, item in enumerate(value):
            name = item.get("name") if isinstance(item, Mapping) else None
            yield from _iterate_leaves(f"{path}[{i if name is None else name}]", item)
    elif isinstance(value, float):
        yield path, value


def as_array(values: float | FloatArray) -> FloatArray:
    """Values (n,) as the core takes them: float64 without gaps. Raises InputError for others.

    Texts, dates and complex numbers are no numbers here, even where NumPy converts them.
    """
    kind = np.asarray(values).dtype.kind
    if kind not in "fiubO":
        given = _KINDS.get(kind, "others")
        raise InputError(f"an array without numbers: it has {given}", "give real numbers in SI")
    if np.ma.is_masked(values):
        raise InputError("an array with masked values", "leave these samples out")
    try:
        column = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"an array without numbers: {error}", "give numbers in SI") from error
    if column.ndim != 1:
        raise InputError(f"an array of shape {column.shape}", "give one with a single axis")
    return column


def require_samples(time: FloatArray, values: FloatArray, delay: float) -> None:
    """Raise InputError for what is no signal: `time` (n,) [s], `values` (n,), `delay` [s]."""
    require_number("delay of a signal", delay)
    time, values = as_array(time), as_array(values)
    if time.size != values.size or time.size < 2:
        what = f"a signal of {time.size} times and {values.size} values"
        raise InputError(what, "give as many values as times, at least two")
    for name, numbers in (("time", time), ("values", values)):
        if not np.isfinite(numbers).all():
            index = int(np.argmin(np.isfinite(numbers)))
            what = f"{name} of a signal: sample {index} is {numbers[index]}"
            raise InputError(what, "leave out samples that are no finite numbers")
    if (time[1:] < time[:-1]).any():
        raise InputError("the times of a signal decrease", "sort the samples by time")


_KINDS = {"U": "texts", "S": "texts", "c": "complex numbers", "M": "dates", "m": "time spans"}
"""Kinds of arrays of NumPy that are refused."""


def require_number(name: str, value: object, *, finite: bool = True) -> float:
    """Return a number in SI. Raises InputError for what is none, or not `finite`."""
    plain = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    if not isinstance(plain, Real):
        what = f"{name} is {format_value(value)}, a {type(value).__name__} and not a number"
        raise InputError(what, "give a number in SI")
    try:
        number = float(plain)
    except OverflowError:
        what = f"{name} is {format_value(value)}, beyond 64-bit numbers"
        raise InputError(what, "give a number in SI") from None
    if finite and not np.isfinite(number):
        raise InputError(f"{name} is {number}", "give a finite number in SI")
    return number


def is_number(value: object) -> bool:
    """Return whether a value is a finite number that a float64 can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except OverflowError:
        return False


def format_value(value: object) -> str:
    """Write a value of any kind, shortened, for a message."""
    try:
        return _SHORT.repr(value)
    except ValueError:  # an integer with more digits than Python writes
        return "an integer of too many digits"


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 80


def as_names(names: Sequence[str]) -> list[str]:
    """Names as the core takes them. Raises InputError for what is no list of texts."""
    if isinstance(names, str):
        raise InputError(
            f"the text {names!r} where a list of names is needed", f"write ({names!r},)"
        )
    if not isinstance(names, Iterable) or not all(isinstance(one, str) for one in names):
        raise InputError(f"{names!r} where a list of names is needed", "give a tuple of texts")
    return list(names)


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


_NAME = {"type": "string", "minLength": 1}


def build_network_schema() -> dict[str, Any]:
    """Return the schema of a list of elements; a field with a unit has it as annotation `unit`."""
    elements = {kind: _describe_element(kind, one) for kind, one in ELEMENT_TYPES.items()}
    choices = [{"$ref": f"#/$defs/{kind}"} for kind in elements]
    return {"type": "array", "minItems": 1, "items": {"oneOf": choices}, "$defs": elements}


def _describe_element(kind: str, element: ElementType) -> dict[str, Any]:
    schema = _describe_fields(element.fields)
    unique = {**_NAME, "description": "Unique name."}
    schema["properties"] = {"type": {"const": kind}, "name": unique, **schema["properties"]}
    schema["required"] = ["type", "name", *schema["required"]]
    return {"title": element.help, "description": element.law or element.help, **schema}


def _describe_fields(fields: Mapping[str, Field]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": {key: _describe_field(one) for key, one in fields.items()},
        "required": [key for key, one in fields.items() if one.required],
        "additionalProperties": False,
    }


def _describe_field(field: Field) -> dict[str, Any]:
    content = _describe_content(field)
    schema = content if field.required else {"anyOf": [content, {"type": "null"}]}
    absent = f" Default: {field.absent}." if field.absent else ""
    unit = {"unit": field.unit} if field.unit else {}
    default = {} if field.default is None else {"default": field.default}
    return {**schema, "description": field.help + absent, **unit, **default}


def _describe_content(field: Field) -> dict[str, Any]:
    match field.kind:
        case FieldKind.NODE | FieldKind.INPUT:
            return _NAME
        case FieldKind.TEXT:
            return {"enum": list(field.choices)}
        case FieldKind.FLAG:
            return {"type": "boolean"}
        case FieldKind.GROUP:
            return {"anyOf": [_describe_fields(fields) for fields in field.group]}
    number = {"type": "number", **_describe_limit(field.limit)}
    if field.kind is FieldKind.NUMBER:
        return number
    numbers = {"type": "array", "items": number, "minItems": 1}
    if field.kind is FieldKind.NUMBERS:
        return numbers
    return {"type": "array", "items": numbers, "minItems": 1}


def _describe_limit(limit: Limit | None) -> dict[str, Any]:
    if limit is None:
        return {}
    bounds = {
        "minimum": limit.least,
        "exclusiveMinimum": limit.above,
        "maximum": limit.most,
        "not": {"enum": list(limit.excluded)} if limit.excluded else None,
    }
    return {key: value for key, value in bounds.items() if value is not None}
