# SPDX-License-Identifier: MIT
"""Format-independent contents of a parameter file: named numbers and curves with units.

A `Codec` writes a `ParameterSet` and reads it back unchanged, after `legal` has respelled the names
and texts that the format does not allow.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import TypeVar

from drivetwin.errors import FileFormatError, InputError, Where


@dataclass(frozen=True)
class Scalar:
    """One number. `unit` is SI in ASCII, `1` without dimension; `text` is one line about it.

    Files for people round it to decimals finer than `resolution`; 0: they keep it as it is. They
    have its `bounds` in the text.
    """

    name: str
    value: float
    unit: str = "1"
    text: str = ""
    resolution: float = 0.0
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True)
class Axis:
    """Breakpoints of a curve, increasing, at least one; `name` is their quantity."""

    name: str
    points: tuple[float, ...]
    unit: str = "1"


@dataclass(frozen=True)
class Curve:
    """Numbers over one axis, as many as the axis has points; the rest as in `Scalar`."""

    name: str
    axis: Axis
    values: tuple[float, ...]
    unit: str = "1"
    text: str = ""
    resolution: float = 0.0
    bounds: tuple[float, float] | None = None


@dataclass(frozen=True)
class ParameterSet:
    """Contents of a parameter file.

    `notes` are lines for people (provenance, unidentified parameters); they are written as
    comments and not read back. `skipped` names what a file holds beyond numbers and curves.
    """

    name: str
    scalars: tuple[Scalar, ...] = ()
    curves: tuple[Curve, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    skipped: tuple[str, ...] = field(default=(), compare=False)

    def __getitem__(self, name: str) -> Scalar | Curve:
        """Number or curve by its name. Raises KeyError."""
        for entry in self.entries:
            if entry.name == name:
                return entry
        raise KeyError(name)

    @property
    def entries(self) -> tuple[Scalar | Curve, ...]:
        """Numbers, then curves."""
        return (*self.scalars, *self.curves)


E = TypeVar("E", Scalar, Curve)


@dataclass(frozen=True)
class Codec:
    """A format as functions: contents of a file, their inverse, and what the format can hold.

    `write` takes a set whose names are put through `spell` and whose texts through `line`. `parse`
    takes the text and the name of its file and raises FileFormatError. `axis_name` is the name
    under which a format writes the axis of a respelled curve, where it does so beside the curve.
    """

    write: Callable[[ParameterSet], str]
    parse: Callable[[str, str], ParameterSet]
    spell: Callable[[str], str]
    line: Callable[[str], str]
    axis_name: Callable[[Curve], str] | None = None

    def text(self, parameters: ParameterSet) -> str:
        """Return the contents of a file. Raises InputError where two names become one."""
        return self.write(self.legal(parameters))

    def legal(self, parameters: ParameterSet) -> ParameterSet:
        """Return the set with names and texts respelled, which is what reading gives back.

        A name that changes is kept in the text. Raises InputError where two names become one.
        """
        changed = ParameterSet(
            name=self.line(parameters.name) or "parameters",
            scalars=tuple(self._respell(one) for one in parameters.scalars),
            curves=tuple(
                replace(
                    self._respell(one),
                    axis=replace(
                        one.axis,
                        name=self.spell(one.axis.name).replace(".", "_"),
                        unit=self.line(one.axis.unit),
                    ),
                )
                for one in parameters.curves
            ),
            notes=tuple(self.line(note) for note in parameters.notes),
        )
        written = zip((repr(one.name) for one in parameters.entries), changed.entries, strict=True)
        names = [(origin, one.name) for origin, one in written]
        if self.axis_name is not None:
            curves = zip(parameters.curves, changed.curves, strict=True)
            names += [(f"the axis of {old.name!r}", self.axis_name(new)) for old, new in curves]
        _refuse_twins(names)
        return changed

    def _respell(self, entry: E) -> E:
        """Return an entry under its legal name; its text has the old name where that changes."""
        name = self.spell(entry.name)
        kept = "" if name == entry.name else f" ({entry.name})"
        text = self.line(entry.text + kept).strip()
        return replace(entry, name=name, text=text, unit=self.line(entry.unit))


def _refuse_twins(names: Iterable[tuple[str, str]]) -> None:
    """Refuse what is written under one name; `names` are of pairs of origin and written name."""
    origins: dict[str, str] = {}
    for origin, name in names:
        if name in origins:
            raise InputError(
                f"{origins[name]} and {origin} are both written as {name!r}",
                "name the elements and gears of the vehicle card with few letters and digits",
            )
        origins[name] = origin


def round_to(value: float, resolution: float) -> float:
    """Round a number to the decimal place that a resolution needs; 0 leaves it as it is."""
    if resolution <= 0.0:
        return value
    return round(value, math.ceil(-math.log10(resolution)))


def state_bounds(one: Scalar | Curve, factor: float) -> str:
    """Return the text of an entry with its bounds, `factor` times those in SI."""
    if one.bounds is None:
        return one.text
    low, high = (factor * end for end in one.bounds)
    return f"{one.text}, {low:.5g} to {high:.5g}"


def format_number(value: float) -> str:
    """Shortest decimal that reads back as the same double, always with a decimal point."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return text if "." in mantissa or not e else f"{mantissa}.0e{exponent}"


def parse_finite(text: str, source: str, key: str) -> float:
    """Number behind a text. Raises FileFormatError, naming `source` and `key`."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileFormatError(
            f"{text.strip()!r} is no finite number",
            "correct the value, with a point as decimal separator",
            Where(file=source, key=key),
        )
    return value


def build_curve(
    name: str, axis: Axis, values: Iterable[float], labels: tuple[str, str], source: str
) -> Curve:
    """Curve from what a file holds; `labels` are its unit and text.

    Raises FileFormatError where points and values do not match or the points do not increase.
    """
    unit, text = labels
    made = Curve(name, axis, tuple(values), unit, text)
    if not made.values or len(made.values) != len(axis.points):
        fault = f"{len(axis.points)} axis points for {len(made.values)} values"
    elif any(a >= b for a, b in zip(axis.points, axis.points[1:], strict=False)):
        fault = "the axis points do not increase"
    else:
        return made
    raise FileFormatError(fault, "correct the curve", Where(file=source, key=name))
