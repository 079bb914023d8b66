# SPDX-License-Identifier: MIT
"""Components of a Modelica model, and inputs as text: samples as one table, sines as equations."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.parameters.content import format_number, make_distinct, to_ascii_line
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Sine

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


Inputs = Mapping[str, Signal | Sine]


def format_table(sampled: Sequence[Signal], span: tuple[float, float]) -> list[str]:
    """Declaration of the `CombiTimeTable` of all sampled inputs; no lines without any.

    An event at each sample would restart the integrator a thousand times a second. Events occur at
    jumps only; elsewhere the step control of the integrator meets the kinks.
    """
    if not sampled:
        return []
    return [
        "  Modelica.Blocks.Sources.CombiTimeTable inputs(",
        f"    columns=2:{len(sampled) + 1},",
        "    smoothness=Modelica.Blocks.Types.Smoothness.LinearSegments,",
        "    extrapolation=Modelica.Blocks.Types.Extrapolation.HoldLastPoint,",
        "    timeEvents=Modelica.Blocks.Types.TimeEvents.AtDiscontinuities,",
        f"    table={format_matrix(_build_table(sampled, span))});",
    ]


def format_equations(names: Mapping[str, str], inputs: Inputs) -> list[str]:
    """Equations of the inputs of the driveline, by their names and identifiers.

    Sampled inputs are the columns of the table in the order of `names`.
    """
    lines = []
    column = 0
    for name, plain in names.items():
        given = inputs[name]
        if isinstance(given, Sine):
            angle = f"{format_number(2.0 * np.pi * given.frequency)}*time"
            wave = f"sin({angle} + ({format_number(given.phase)}))"
            amplitude = f"({format_number(given.amplitude)})"
            value = f"{format_number(given.offset)} + {amplitude}*{wave}"
        else:
            column += 1
            value = f"inputs.y[{column}]"
        lines.append(f"driveline.{plain} = {value};")
    return lines


def select_sampled(names: Mapping[str, str], inputs: Inputs) -> list[Signal]:
    """Sampled inputs in the order of `names`. Raises InputError for an input that is missing."""
    missing = [name for name in names if name not in inputs]
    if missing:
        raise InputError(
            f"the run has no input {', '.join(map(repr, missing))}",
            "give each input of the driveline a Signal or a Sine",
        )
    given = (inputs[name] for name in names)
    return [one for one in given if isinstance(one, Signal)]


def _build_table(sampled: Sequence[Signal], span: tuple[float, float]) -> list[tuple[float, ...]]:
    """Time and inputs at every sample of any input within the run, each linear in between.

    Where an input jumps the time stands twice, as Modelica's table wants it.
    """
    first, last = span
    moments = np.unique(np.concatenate([one.arrival for one in sampled]))
    jumps = np.concatenate([one.arrival[1:][np.diff(one.arrival) == 0.0] for one in sampled])
    inner = moments[(moments > first) & (moments < last)]
    twice = inner[np.isin(inner, jumps)]
    time: FloatArray = np.sort(np.concatenate([[first], inner, twice, [last]]))
    ends = np.append(np.diff(time) == 0.0, True)  # rows that end what came before
    columns = [
        np.where(ends, _evaluate_left_limit(one, time), np.interp(time, one.arrival, one.values))
        for one in sampled
    ]
    return [tuple(float(value) for value in row) for row in zip(time, *columns, strict=True)]


def _evaluate_left_limit(signal: Signal, time: FloatArray) -> FloatArray:
    """Values at `time` (n,) [s]; at a jump the one before it."""
    return np.interp(-time, -signal.arrival[::-1], signal.values[::-1])
