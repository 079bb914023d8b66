# SPDX-License-Identifier: MIT
"""Arguments of the element methods: plates of a clutch, and help with units, ranges, defaults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from textwrap import fill
from typing import Any, TypeVar

from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from drivetwin.simulation.element_schema import ELEMENT_TYPES, ElementType, Field, FieldKind

FIELD_OF = {"at": "node", "value": "input"}
"""Fields whose parameter has another name."""
_TYPES = {
    FieldKind.NODE: "place",
    FieldKind.INPUT: "value of an input",
    FieldKind.NUMBER: "float",
    FieldKind.NUMBERS: "sequence of floats",
    FieldKind.ROWS: "rows of floats",
}
_WIDTH = 88
_HARD_SPACE = "\xa0"
"""Space at which no line is broken."""
_Class = TypeVar("_Class", bound=type)


@dataclass(frozen=True)
class Plates:
    """Capacity of a clutch: μ(|slip|) · gain · (pressure - p0), static `peak` times that at rest.

    `friction` is a law or a constant μ; gain in m³, p0 in Pa, drum inertia in kg·m². By default
    the pressure itself is the capacity [N·m]. `drag` are the fields of a table of drag torque over
    slip, or none.
    """

    friction: Stribeck | FrictionTable | float = 1.0
    gain: float = 1.0
    p0: float = 0.0
    peak: float = 1.0
    drum_inertia: float = 0.0
    drag: Mapping[str, Any] | None = None

    def describe(self) -> dict[str, Any]:
        """Return the fields of the element."""
        law = self.friction
        friction: Any = (
            asdict(law)
            if isinstance(law, Stribeck | FrictionTable)
            else {"slip": [0.0], "mu": [law]}
        )
        return {
            "friction": friction,
            "gain": self.gain,
            "p0": self.p0,
            "peak": self.peak,
            "drum_inertia": self.drum_inertia,
            **({} if self.drag is None else {"drag": dict(self.drag)}),
        }


def document_methods(methods: _Class) -> _Class:
    """Write the docstrings of the element methods of a class from the schema of the core."""
    for kind, element in ELEMENT_TYPES.items():
        method = getattr(methods, kind)
        code = method.__code__
        names = code.co_varnames[1 : code.co_argcount + code.co_kwonlyargcount]
        method.__doc__ = "\n".join(_describe_method(element, names))
    return methods


def _describe_method(element: ElementType, names: tuple[str, ...]) -> Iterator[str]:
    yield element.help
    if element.law:
        yield f"\n{_wrap(element.law)}"
    yield "\nParameters\n----------\nname : str\n    Unique name."
    for name in names[1:]:
        field = element.fields.get(FIELD_OF.get(name, name))
        if field is None:
            yield f"{name} : Plates\n{_indent(str(Plates.__doc__).split('.')[0])}."
        else:
            yield f"{name} : {', '.join(_annotate(field))}\n{_indent(field.help)}"


def _annotate(field: Field) -> Iterator[str]:
    if field.kind is FieldKind.GROUP:
        yield " or ".join(f"mapping of {', '.join(fields)}" for fields in field.group)
    else:
        yield _TYPES[field.kind]
    if field.unit:
        yield field.unit
    if field.limit and (limit := field.limit.describe()):
        yield limit
    if field.default is not None:
        yield f"default {field.default}"
    elif field.absent:
        yield f"default: {field.absent}"


def _indent(text: str) -> str:
    return _wrap(" ".join(text.split()), indent="    ")


def _wrap(text: str, indent: str = "") -> str:
    """Wrap a text at spaces outside of literals, which have to stand on one line."""
    pieces = text.split("`")
    pieces[1::2] = [one.replace(" ", _HARD_SPACE) for one in pieces[1::2]]
    wrapped = fill(
        "`".join(pieces),
        _WIDTH,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
    )
    return wrapped.replace(_HARD_SPACE, " ")
