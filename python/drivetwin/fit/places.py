# SPDX-License-Identifier: MIT
"""Numbers of a network and of its channels by path, and quantities of inputs and outputs."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast, get_args

from drivetwin.channels.roles import Quantity
from drivetwin.errors import InputError, suggest_spelling
from drivetwin.fit.number_kinds import USUAL, UsualDeviation, get_usual_beside
from drivetwin.simulation.element_schema import (
    ELEMENT_FIELDS,
    FieldKind,
    Limit,
    is_number,
    list_inputs,
)
from drivetwin.simulation.element_schema import Field as ElementField
from drivetwin.simulation.network import Output, OutputKind, Start

Keys = tuple[int | str, ...]
"""Keys that lead to a number of a run: `elements`, `speeds`, `twists`, `levels` of
constant inputs, `inputs` and `outputs` as channels."""

CHANNEL: Mapping[str, float] = {"gain": 1.0, "offset": 0.0, "delay": 0.0, "curve": 0.0}
"""Numbers of a channel without errors: gain · x + curve · x·|x| + offset, with x at t - delay."""


class Place(NamedTuple):
    """Number by its `path`: the `keys` that lead to it, its schema and value.

    `field` is the path of its field in an element; `usual` the deviation of a number that is not
    an unknown.
    """

    path: str
    keys: Keys
    field: str
    schema: ElementField
    value: float
    usual: UsualDeviation


def list_places(
    elements: Sequence[Mapping[str, Any]],
    start: Start,
    inputs: Iterable[str],
    levels: Mapping[str, float],
    outputs: Mapping[str, Output],
) -> dict[str, Place]:
    """List the numbers of a network and of its channels by path.

    Parameters
    ----------
    elements
        Elements of the network.
    start
        Start with the twist of each shaft.
    inputs
        Names of measured inputs.
    levels
        Values of constant inputs, SI.
    outputs
        Compared quantities by name.
    """
    found: list[Place] = []
    for index, element in enumerate(elements):
        kinds = USUAL[str(element["type"])]
        for keys, field, schema, number in iterate_numbers(element):
            path = ".".join(map(str, (element["name"], *keys)))
            keys = ("elements", index, *keys)
            found.append(Place(path, keys, field, schema, number, kinds[field]))
    shown = {name: get_output_quantity(one) for name, one in outputs.items()}
    found += _list_channels("outputs", shown)
    read = {name: find_input_quantity(name, elements) for name in inputs}
    found += _list_channels("inputs", read)
    for name, value in levels.items():
        unit = find_input_quantity(name, elements).unit
        found.append(_make_place("input", ("levels", name), value, unit, known=False))
    for table, unit, values in (("twists", "rad", start.twists), ("speeds", "rad/s", start.speeds)):
        found += [_make_place("start", (table, name), one, unit) for name, one in values.items()]
    return {one.path: one for one in found}


def _list_channels(table: str, quantities: Mapping[str, Quantity]) -> list[Place]:
    """List the numbers of measured inputs or outputs; the core has derivatives by the delays of
    inputs alone."""
    return [
        _make_place(
            head,
            (table, name, head),
            value,
            {"gain": "1", "offset": quantity.unit, "delay": "s", "curve": f"1/({quantity.unit})"}[
                head
            ],
            known=table == "inputs" and head == "delay",
            quantity=quantity,
        )
        for name, quantity in quantities.items()
        for head, value in CHANNEL.items()
    ]


def _make_place(
    head: str,
    keys: Keys,
    value: float,
    unit: str,
    *,
    known: bool = True,
    quantity: Quantity | None = None,
) -> Place:
    limit = Limit(None, 0.0, None, ()) if head == "gain" else None
    schema = ElementField(
        FieldKind.NUMBER, False, None, value, known, unit, limit, (), (), f"{head} of {keys[1]}"
    )
    usual = get_usual_beside(head, str(keys[0]), quantity)
    return Place(f"{head}.{keys[1]}", keys, head, schema, value, usual)


def find_place(path: str, places: Mapping[str, Place]) -> Place:
    """Return the place at a path; raises InputError where there is none, with those near it."""
    if path in places:
        return places[path]
    head = path.partition(".")[0]
    heads = dict.fromkeys(one.partition(".")[0] for one in places)
    near = {
        f"{head}.{one.field}" if one.keys[0] == "elements" else one.path: None
        for one in places.values()
        if one.path.startswith(f"{head}.")
    }
    hint = suggest_spelling(path if near else head, near or heads)
    if path in near:
        hint = f"; name one of the list, such as {path}.0"
    raise InputError(
        f"{path}: no number of the model{hint}", f"known are {', '.join(near or heads)}"
    )


class Numbers:
    """Parts of a run, of which each element or table is copied before a number of it changes."""

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self.tables = {key: copy.copy(one) for key, one in tables.items()}
        self._copied: set[Keys] = set()

    def get(self, keys: Keys) -> float:
        """Return the number to which the keys lead."""
        found: Any = self.tables
        for key in keys:
            found = found[key]
        return cast("float", found)

    def put(self, keys: Keys, number: float) -> None:
        """Replace the number to which the keys lead."""
        *path, last = keys[1:]
        place = self.tables[str(keys[0])]
        if path and keys[:2] not in self._copied:
            place[path[0]] = copy.deepcopy(place[path[0]])
            self._copied.add(keys[:2])
        for key in path:
            place = place[key]
        place[last] = number


def iterate_numbers(element: Mapping[str, Any]) -> Iterator[tuple[Keys, str, ElementField, float]]:
    """Yield the keys, the path of the field, its schema and the value of each number of an
    element."""
    fields = ELEMENT_FIELDS[str(element["type"])]
    waiting: list[tuple[Keys, str, ElementField, Any]] = [
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


def _iterate_cells(value: Any) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and the value of a number, or of each one of a list or table."""
    if isinstance(value, list | tuple):
        for k, each in enumerate(value):
            yield from (((k, *keys), number) for keys, number in _iterate_cells(each))
    elif is_number(value):
        yield (), value


_OF_INPUTS = {
    "torque": Quantity.TORQUE,
    "prescribed_speed": Quantity.SPEED,
    "engine_map": Quantity.FRACTION,
}
"""Quantities of the inputs of elements; those of all others are pressures."""
_OF_OUTPUTS = {
    **dict.fromkeys(("speed", "slip"), Quantity.SPEED),
    **dict.fromkeys(("shaft_torque", "torque", "friction_torque"), Quantity.TORQUE),
}
"""Quantities of compared outputs by kind; others are numbers in SI."""


def find_input_quantity(name: str, elements: Sequence[Mapping[str, Any]]) -> Quantity:
    """Return the quantity of an input by the element that takes it."""
    for element in elements:
        if name in list_inputs(element):
            return _OF_INPUTS.get(str(element["type"]), Quantity.PRESSURE)
    return Quantity.STATE


def to_output(quantity: Sequence[str]) -> Output:
    """Return a kind and a name as an output of a network.

    Raises InputError for a kind that does not exist.
    """
    kind, name = quantity
    kinds = get_args(OutputKind)
    if kind not in kinds:
        hint = suggest_spelling(kind, kinds)
        raise InputError(f"{kind!r} is no quantity{hint}", f"known are {', '.join(kinds)}")
    return (cast(OutputKind, kind), name)


def get_output_quantity(output: Output) -> Quantity:
    """Return the quantity of an output; `state` for one without a unit table."""
    return _OF_OUTPUTS.get(output[0], Quantity.STATE)
