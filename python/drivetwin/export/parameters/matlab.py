# SPDX-License-Identifier: MIT
"""MATLAB script (.m): one variable per number, a vector pair per curve, units in the comments.

A curve `mu_B3` has its breakpoints in `mu_B3_slip`. The script is read back line by line, not run.
"""

from __future__ import annotations

import re
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.export.parameters.content import (
    Axis,
    Codec,
    Curve,
    ParameterSet,
    Scalar,
    build_curve,
    format_number,
    parse_finite,
    to_ascii_line,
    to_flat_name,
)

_TITLE = "%% Parameters of "
_LINE = re.compile(r"(\w+)\s*=\s*([^;%]+);\s*(?:%\s*\[([^\]]*)\]\s*(.*))?")
_BREAKPOINTS = re.compile(r"breakpoints (\w+) of (\w+)")


def _make_breakpoints_name(curve: Curve) -> str:
    return to_flat_name(f"{curve.name}_{curve.axis.name}")


def _write_m(content: ParameterSet) -> str:
    lines = [f"{_TITLE}{content.name}", *(f"% {note}" for note in content.notes), ""]
    for scalar in content.scalars:
        lines.append(
            _format_assignment(scalar.name, format_number(scalar.value), scalar.unit, scalar.text)
        )
    for curve in content.curves:
        text = f"breakpoints {curve.axis.name} of {curve.name}"
        over = _make_breakpoints_name(curve)
        lines += [
            "",
            _format_assignment(over, _format_row(curve.axis.points), curve.axis.unit, text),
        ]
        lines.append(
            _format_assignment(curve.name, _format_row(curve.values), curve.unit, curve.text)
        )
    return "\n".join(lines) + "\n"


def _format_assignment(name: str, value: str, unit: str, text: str) -> str:
    return f"{name} = {value}; % [{unit}] {text}".rstrip()


def _format_row(values: tuple[float, ...]) -> str:
    return "[" + " ".join(format_number(value) for value in values) + "]"


def _parse_m(text: str, source: str) -> ParameterSet:
    """Read assignments of numbers and row vectors; other lines are named as skipped.

    Raises FileFormatError where nothing is assigned or a curve is damaged.
    """
    scalars: list[Scalar] = []
    vectors: dict[str, Curve] = {}
    axes: dict[str, Axis] = {}
    name, skipped = Path(source).stem, []
    for raw in text.splitlines():
        line = raw.strip()
        if line.startswith(_TITLE):
            name = line.removeprefix(_TITLE)
        found = _LINE.fullmatch(line)
        if found is None:
            skipped += [line] if line and not line.startswith("%") else []
            continue
        label, value, unit, about = found[1], found[2].strip(), found[3] or "1", found[4] or ""
        if not value.startswith("["):
            scalars.append(Scalar(label, parse_finite(value, source, label), unit, about))
            continue
        values = tuple(
            parse_finite(word, source, label)
            for word in value.strip("[]").replace(",", " ").split()
        )
        if points := _BREAKPOINTS.fullmatch(about):
            axes[points[2]] = Axis(points[1], values, unit)
        else:
            vectors[label] = Curve(label, Axis("x", ()), values, unit, about)
    if not scalars and not vectors:
        raise FileFormatError(
            "no assignment of a number", "hand in a parameter script", Where(file=source)
        )
    skipped += [label for label in vectors if label not in axes]
    curves = [
        build_curve(label, axes[label], one.values, (one.unit, one.text), source)
        for label, one in vectors.items()
        if label in axes
    ]
    return ParameterSet(name, tuple(scalars), tuple(curves), skipped=tuple(skipped))


CODEC = Codec(_write_m, _parse_m, to_flat_name, to_ascii_line, _make_breakpoints_name)
