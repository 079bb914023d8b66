# SPDX-License-Identifier: MIT
"""ETAS DCM (Konservierungsformat 2.0), as INCA, CANape and MDA read it.

Keywords are German and at line starts; texts are 7-bit in double quotes; a name is a letter or `_`
followed by letters, digits, `_`, `.` and brackets; lists break after six numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.export.parameters.content import (
    Axis,
    Curve,
    ParameterSet,
    Scalar,
    curve_of,
    finite,
    legal,
    number,
)
from drivetwin.export.parameters.spelling import (
    ascii_line,
    dotted_name,
    shown_unit,
    unit_of,
    with_axis,
    without_axis,
)

_FORMAT = "KONSERVIERUNG_FORMAT"
_PER_LINE = 6
_CURVES = ("KENNLINIE", "FESTKENNLINIE", "GRUPPENKENNLINIE")
_OTHERS = ("FESTWERTEBLOCK", "KENNFELD", "FESTKENNFELD", "GRUPPENKENNFELD", "TEXTSTRING")
_BLOCKS = ("FESTWERT", *_CURVES, *_OTHERS, "STUETZSTELLENVERTEILUNG", "FUNKTIONEN")
_COMMENTS = ("*", "!", ".")

_Fields = dict[str, list[str]]


def legal_for_dcm(parameters: ParameterSet) -> ParameterSet:
    """The set as the format can hold it."""
    return legal(parameters, dotted_name, ascii_line)


def dcm_text(parameters: ParameterSet) -> str:
    """Contents of the file."""
    content = legal_for_dcm(parameters)
    function = dotted_name(content.name)
    lines = [f"* {note}" for note in content.notes]
    lines += ["", f"{_FORMAT} 2.0", "", "FUNKTIONEN"]
    lines += [f'  FKT {function} "" "{content.name}"', "END", ""]
    for scalar in content.scalars:
        lines += [f"FESTWERT {scalar.name}", *_head(scalar, function)]
        lines += [f'  EINHEIT_W "{shown_unit(scalar.unit)}"', f"  WERT {number(scalar.value)}"]
        lines += ["END", ""]
    for curve in content.curves:
        described = replace(curve, text=with_axis(curve.text, curve.axis.name))
        lines += [f"KENNLINIE {curve.name} {len(curve.values)}", *_head(described, function)]
        lines += [f'  EINHEIT_X "{shown_unit(curve.axis.unit)}"']
        lines += [f'  EINHEIT_W "{shown_unit(curve.unit)}"']
        lines += [*_listed("ST/X", curve.axis.points), *_listed("WERT", curve.values), "END", ""]
    return "\n".join(lines)


def _head(entry: Scalar | Curve, function: str) -> list[str]:
    return [f'  LANGNAME "{entry.text}"', f"  FUNKTION {function}"]


def _listed(keyword: str, values: tuple[float, ...]) -> Iterator[str]:
    for start in range(0, len(values), _PER_LINE):
        yield f"  {keyword} " + " ".join(number(v) for v in values[start : start + _PER_LINE])


def parse_dcm(text: str, source: str) -> ParameterSet:
    """Read fixed values and characteristic curves; other objects are named as skipped.

    Raises FileFormatError where the file is no DCM or an object is damaged.
    """
    lines = [line.strip() for line in text.splitlines()]
    if not any(line.startswith(_FORMAT) for line in lines):
        raise FileFormatError(
            f"no line {_FORMAT}", "hand in a DCM file of format 2.0", Where(file=source)
        )
    name = Path(source).stem
    scalars, curves, skipped = [], [], []
    for kind, rest, fields in _blocks(lines, source):
        label = rest.split(maxsplit=1)[0] if rest else ""
        if kind == "FUNKTIONEN":
            name = _function_name(fields) or name
        elif kind == "FESTWERT" and "WERT" in fields:
            scalars.append(_scalar(label, fields, source))
        elif kind in _CURVES and "WERT" in fields and "ST/X" in fields:
            curves.append(_curve(label, fields, source))
        else:
            skipped.append(f"{kind} {label}")
    return ParameterSet(name, tuple(scalars), tuple(curves), skipped=tuple(skipped))


def _blocks(lines: list[str], source: str) -> Iterator[tuple[str, str, _Fields]]:
    """Keyword, rest of its line and the fields of every block up to its END."""
    open_block: tuple[str, str, _Fields] | None = None
    for line in lines:
        if line.startswith(_COMMENTS):
            continue
        keyword, rest = (*line.split(maxsplit=1), "", "")[:2]  # blanks or tabs between them
        if keyword == "END" and open_block is not None:
            yield open_block
            open_block = None
        elif keyword in _BLOCKS:
            if open_block is not None:
                break
            open_block = (keyword, rest.strip(), {})
        elif keyword and open_block is not None:
            open_block[2].setdefault(keyword, []).append(rest.strip())
    if open_block is not None:
        raise FileFormatError(
            "the object has no END", "complete the file", Where(file=source, key=open_block[1])
        )


def _function_name(fields: _Fields) -> str:
    quoted = re.findall(r'"([^"]*)"', fields.get("FKT", [""])[0])
    return quoted[-1] if quoted else ""


def _quoted(fields: _Fields, keyword: str) -> str:
    return fields.get(keyword, [""])[0].strip().strip('"')


def _numbers(fields: _Fields, keyword: str, label: str, source: str) -> tuple[float, ...]:
    words = " ".join(fields[keyword]).split()
    return tuple(finite(word, source, label) for word in words)


def _scalar(label: str, fields: _Fields, source: str) -> Scalar:
    value = finite(fields["WERT"][0], source, label)
    return Scalar(label, value, unit_of(_quoted(fields, "EINHEIT_W")), _quoted(fields, "LANGNAME"))


def _curve(label: str, fields: _Fields, source: str) -> Curve:
    text, over = without_axis(_quoted(fields, "LANGNAME"))
    axis = Axis(
        over,
        _numbers(fields, "ST/X", label, source),
        unit_of(_quoted(fields, "EINHEIT_X")),
    )
    labels = (unit_of(_quoted(fields, "EINHEIT_W")), text)
    return curve_of(label, axis, _numbers(fields, "WERT", label, source), labels, source)
