# SPDX-License-Identifier: MIT
"""The pieces of a Modelica model, before they become text, and the tokens of that text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib import resources

from drivetwin.export.parameters.content import format_number
from drivetwin.export.parameters.spelling import make_distinct, to_ascii_line

SLIP_INERTIA = "SlipInertia"
PAPER_GEAR = "ConstantEfficiencyGear"
CONVERTER = "TorqueConverter"
SPRING_TABLE = "SpringTable"
TYRE = "TyreSlip"
LOSS_GEAR = "LossTableGear"
LOSS_PLANETARY = "LossTablePlanetary"
DRAG = "ClutchDrag"
VISCOUS = "ViscousCoupling"


def read_helper(name: str) -> str:
    """Return the source of a model by its name."""
    file = resources.files("drivetwin.export.modelica") / "library" / f"{name}.mo"
    return file.read_text(encoding="utf-8")


_KEYWORDS = re.compile(
    "algorithm|and|annotation|assert|block|break|class|connect|connector|constant|constrainedby|"
    "der|discrete|each|else|elseif|elsewhen|encapsulated|end|enumeration|equation|expandable|"
    "extends|external|false|final|flow|for|function|if|import|impure|in|initial|inner|input|loop|"
    "model|not|operator|or|outer|output|package|parameter|partial|protected|public|pure|record|"
    "redeclare|replaceable|return|stream|then|time|true|type|when|while|within"
)


def make_identifier(name: str) -> str:
    """The name in letters, digits and `_`, no digit in front, and no keyword."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", to_ascii_line(name))
    return f"x_{plain}" if not re.match("[A-Za-z]", plain) or _KEYWORDS.fullmatch(plain) else plain


def make_identifiers(names: Iterable[str]) -> dict[str, str]:
    """An identifier for each name; those that would coincide are numbered."""
    return make_distinct(names, make_identifier)


def format_string(text: str) -> str:
    """A string literal."""
    return f'"{to_ascii_line(text)}"'


def format_matrix(rows: Iterable[Sequence[float]]) -> str:
    """A matrix literal, one row per line where there are several."""
    lines = [", ".join(format_number(value) for value in row) for row in rows]
    return "[" + ";\n      ".join(lines) + "]"


ROTATIONAL = "Modelica.Mechanics.Rotational"

Flanges = tuple[tuple[str, str], ...]
"""Flanges of a component by name, each with its node."""
Modifiers = tuple[tuple[str, str], ...]
"""Parameters of a component by name, each with the text of its value."""


@dataclass(frozen=True)
class Component:
    """A declared component."""

    type: str
    name: str
    modifiers: Modifiers = ()
    flanges: Flanges = ()

    def format_declaration(self) -> str:
        """Its line in the model."""
        values = ", ".join(f"{key}={value}" for key, value in self.modifiers)
        return f"  {self.type} {self.name}({values});" if values else f"  {self.type} {self.name};"


@dataclass(frozen=True)
class Part:
    """Declarations and equations of one network element.

    `helpers` names the models it takes that the Standard Library lacks; `rest` is the expression
    that is zero while a friction element does not slip.
    """

    components: tuple[Component, ...]
    equations: tuple[str, ...] = ()
    parameters: tuple[str, ...] = ()
    helpers: frozenset[str] = frozenset()
    rest: str = ""


def format_values(**modifiers: float) -> Modifiers:
    """Modifiers from numbers."""
    return tuple((key, format_number(value)) for key, value in modifiers.items())


@dataclass(frozen=True)
class Names:
    """Identifiers of elements and of inputs by their names in the network.

    `delays` [s] are those between an input of the model and the parts that take it, by input.
    """

    elements: dict[str, str] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)
    delays: dict[str, float] = field(default_factory=dict)

    def get_acting(self, name: str) -> str:
        """Identifier of an input behind its delay."""
        plain = self.inputs[name]
        return f"{plain}_acting" if name in self.delays else plain
