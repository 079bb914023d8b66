# SPDX-License-Identifier: MIT
"""Contents of a parameter file of any format: numbers, curves, units, names and texts."""

from __future__ import annotations

import math
import re
import unicodedata
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import TypeVar

from drivetwin._util.display_units import BAR, RPM, get_display_unit
from drivetwin._util.text import escape_line, escape_text
from drivetwin.errors import FileFormatError, InputError, Where


def add_child(parent: ET.Element, tag: str, text: str = "", **attributes: str) -> ET.Element:
    """Append an element with a text and return it."""
    element = ET.SubElement(parent, tag, attributes)
    element.text = text or None
    return element


def format_comment(lines: Iterable[str]) -> str:
    """The lines as one XML comment, which may not hold two hyphens; nothing without lines."""
    text = "\n".join(f"  {escape_line(line)}" for line in lines)
    text = re.sub("-(?=-)", "- ", text)
    return f"<!--\n{text}\n-->" if text else ""


def format_document(root: ET.Element, *heads: str) -> str:
    """Return the tree as indented UTF-8 text, behind the declaration and further `heads`.

    Characters without a glyph, most of which XML cannot hold, are written as escapes.
    """
    for element in root.iter():
        element.text = element.text and escape_text(element.text)
        element.attrib.update({key: escape_line(text) for key, text in element.attrib.items()})
    ET.indent(root)
    body = ET.tostring(root, encoding="unicode")
    declaration = '<?xml version="1.0" encoding="UTF-8"?>'
    return "\n".join(part for part in (declaration, *heads, body) if part) + "\n"


def parse_xml(text: str, source: str) -> ET.Element:
    """Root of a document. Raises FileFormatError where it is no XML or declares entities."""
    if "<!ENTITY" in text:
        raise FileFormatError(
            "the document declares entities", "write them out", Where(file=source)
        )
    try:
        return ET.fromstring(text.encode("utf-8"), parser=ET.XMLParser(encoding="utf-8"))
    except ET.ParseError as fault:
        raise FileFormatError(
            f"no XML: {fault}", "hand in the file as it was written", Where(file=source)
        ) from None


def get_text(element: ET.Element, path: str) -> str:
    """Text of the first element at `path`, empty where there is none."""
    return (element.findtext(path) or "").strip()


_GREEK = {
    letter: unicodedata.name(letter).rpartition(" ")[2].lower()
    for letter in map(chr, range(ord("α"), ord("ω") + 1))
}
_SIGNS = {
    "µ": "mu",
    "λ": "lambda",
    "Δ": "Delta",
    "Σ": "Sigma",
    "±": "+/-",
    "×": "x",
    "≈": "~",
    "≤": "<=",
    "≥": ">=",
    "°": "deg ",
    "′": "'",
    "·": "*",
    "→": "->",
    "–": "-",
    "—": "-",
    "−": "-",
    "⁻": "^-",
    "²": "^2",
    "³": "^3",
    "ß": "ss",
}
_REPLACED = str.maketrans({**_GREEK, **_SIGNS})

_MATLAB_NAME_LENGTH = 63
_MATLAB_KEYWORDS = re.compile(
    "break|case|catch|classdef|continue|else|elseif|end|for|function|global|if|otherwise|parfor|"
    "persistent|return|spmd|switch|try|while"
)


def to_one_line(text: str) -> str:
    """The text with white space as single blanks, without control characters."""
    kept = (
        " " if char.isspace() else char
        for char in text
        if char.isspace() or unicodedata.category(char) not in _UNPRINTABLE
    )
    return " ".join("".join(kept).split())


_UNPRINTABLE = frozenset({"Cc", "Cf", "Cn", "Co", "Cs"})
"""Unicode categories that an XML file may not hold or that nobody sees."""


def to_ascii_line(text: str) -> str:
    """One line in 7 bits, without the double quote and the backslash that would end or escape it.

    Greek letters are spelled, accents dropped; what has no counterpart becomes a question mark.
    """
    plain = unicodedata.normalize("NFKD", to_one_line(text).translate(_REPLACED))
    bare = "".join(char for char in plain if not unicodedata.combining(char))
    return to_one_line(
        bare.encode("ascii", "replace").decode().replace('"', "'").replace("\\", "/")
    )


def to_free_name(name: str) -> str:
    """Any name on one line, `_` where nothing is left."""
    return to_one_line(name) or "_"


def to_dotted_name(name: str) -> str:
    """Identifier of calibration tools: letters, digits, `_` and `.`, no digit or dot in front.

    Something stands after every dot, as in the structured names of FMI.
    """
    plain = re.sub(r"^(?=[0-9.])|^$", "_", re.sub(r"[^A-Za-z0-9_.]", "_", to_ascii_line(name)))
    return re.sub(r"\.(?=\.|$)", "_", plain)


def to_flat_name(name: str) -> str:
    """Identifier of MATLAB: letters, digits and `_`, a letter in front, at most 63 characters."""
    flat = re.sub(r"[^A-Za-z0-9_]", "_", to_ascii_line(name))
    if not flat[:1].isalpha() or _MATLAB_KEYWORDS.fullmatch(flat):
        flat = f"p_{flat}"
    return flat[:_MATLAB_NAME_LENGTH]


def make_distinct(names: Iterable[str], spelled: Callable[[str], str]) -> dict[str, str]:
    """Each name as `spelled`; those that would coincide are numbered."""
    chosen: dict[str, str] = {}
    for name in names:
        one, count = spelled(name), 1
        while one in chosen.values():
            count += 1
            one = spelled(f"{name} {count}")
        chosen[name] = one
    return chosen


def to_tool_unit(unit: str) -> str:
    """Unit as calibration tools show it: `-` without dimension."""
    return "-" if unit == "1" else unit


def parse_tool_unit(shown: str) -> str:
    """Inverse of `to_tool_unit`; nothing at all also means without dimension."""
    return "1" if shown.strip() in ("", "-") else shown.strip()


def choose_unit(si: str) -> tuple[str, float]:
    """Return the unit for people and its factor from SI; units but bar and rpm stay SI."""
    display = get_display_unit(si)
    return (display.label, display.factor) if display in (BAR, RPM) else (si, 1.0)


def append_axis(text: str, axis: str) -> str:
    """Description of a curve that also names its axis, for formats without a place for that."""
    return f"{text} (over {axis})".strip()


def split_axis(text: str) -> tuple[str, str]:
    """Inverse of `append_axis`: text and axis, which is `x` where none is named."""
    found = re.fullmatch(r"(.*?) ?\(over ([A-Za-z0-9_.]+)\)", text)
    return (found[1], found[2]) if found else (text, "x")


_BASE = {
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Hz": {"s": -1},
    "1": {},
}
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(\d+(?:\.\d+)?))?")


def parse_base_units(unit: str) -> dict[str, int] | None:
    """Powers of kg, m, s and rad behind a unit; None where they are not whole numbers.

    What follows a `/` is one denominator, with or without parentheses. Raises InputError for a
    unit that is not made of these.
    """
    powers: dict[str, Fraction] = {}
    for sign, group in _parse_groups(unit):
        for name, power in group:
            for base, own in _BASE[name].items():
                powers[base] = powers.get(base, Fraction(0)) + sign * power * own
    if any(power.denominator != 1 for power in powers.values()):
        return None
    return {base: int(power) for base, power in powers.items() if power}


def is_same_unit(stated: str, expected: str) -> bool:
    """Return True if the unit in a file is `expected`; a missing unit, `1`, is accepted.

    Units with equal base units are the same, e.g. `Pa` and `N/m^2`.
    """
    if stated in ("1", expected):
        return True
    try:
        return parse_base_units(stated) == parse_base_units(expected)
    except InputError:
        return False


def _parse_groups(unit: str) -> list[tuple[int, list[tuple[str, Fraction]]]]:
    numerators, *denominators = unit.replace("(", "").replace(")", "").split("/")
    return [
        (sign, [_parse_factor(part, unit) for part in group.split("*")])
        for sign, group in ((1, numerators), *((-1, each) for each in denominators))
    ]


def _parse_factor(text: str, unit: str) -> tuple[str, Fraction]:
    found = _FACTOR.fullmatch(text.strip())
    if found is None or found[1] not in _BASE:
        raise InputError(
            f"unit {unit!r} is not made of {', '.join(_BASE)}", "write it in SI, as in N*m*s/rad"
        )
    return found[1], Fraction(found[2] or 1)


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

    def name_common_axes(self) -> dict[Axis, str]:
        """Name the axes that several curves share."""
        counts = Counter(one.axis for one in self.curves)
        shared = [axis for axis, count in counts.items() if count > 1]
        return {axis: f"{axis.name}_axis_{k + 1}" for k, axis in enumerate(shared)}


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
                "name elements and gears of the vehicle card with few letters and digits, and give "
                "each label of a template once",
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
