# SPDX-License-Identifier: MIT
"""ETAS DCM (Konservierungsformat 2.0), as INCA, CANape and MDA read it.

Keywords are German and at line starts; texts are 7-bit in double quotes; a name is a letter or `_`
followed by letters, digits, `_`, `.` and brackets; lists break after six numbers.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drivetwin.errors import FileFormatError, Where
from drivetwin.export.parameters.content import (
    Axis,
    Codec,
    Curve,
    ParameterSet,
    Scalar,
    append_axis,
    build_curve,
    format_number,
    parse_finite,
    parse_tool_unit,
    split_axis,
    to_ascii_line,
    to_dotted_name,
    to_tool_unit,
)

_FORMAT = "KONSERVIERUNG_FORMAT"
_PER_LINE = 6
_CURVES = ("KENNLINIE", "FESTKENNLINIE", "GRUPPENKENNLINIE")
_OTHERS = ("FESTWERTEBLOCK", "KENNFELD", "FESTKENNFELD", "GRUPPENKENNFELD", "TEXTSTRING")
_BLOCKS = ("FESTWERT", *_CURVES, *_OTHERS, "STUETZSTELLENVERTEILUNG", "FUNKTIONEN")
_COMMENTS = ("*", "!", ".")

_Fields = dict[str, list[str]]


def _write_dcm(content: ParameterSet) -> str:
    function = to_dotted_name(content.name)
    lines = [f"* {note}" for note in content.notes]
    lines += ["", f"{_FORMAT} 2.0", "", "FUNKTIONEN"]
    lines += [f'  FKT {function} "" "{content.name}"', "END", ""]
    for scalar in content.scalars:
        lines += [f"FESTWERT {scalar.name}", *_format_head(scalar, function)]
        lines += [
            f'  EINHEIT_W "{to_tool_unit(scalar.unit)}"',
            f"  WERT {format_number(scalar.value)}",
        ]
        lines += ["END", ""]
    common = _name_common_axes(content)
    for axis, name in common.items():
        lines += [f"STUETZSTELLENVERTEILUNG {name} {len(axis.points)}", f"  FUNKTION {function}"]
        lines += [f'  EINHEIT_X "{to_tool_unit(axis.unit)}"', *_format_list("ST/X", axis.points)]
        lines += ["END", ""]
    for curve in content.curves:
        described = replace(curve, text=append_axis(curve.text, curve.axis.name))
        own = common.get(curve.axis)
        kind = "KENNLINIE" if own is None else "GRUPPENKENNLINIE"
        lines += [f"{kind} {curve.name} {len(curve.values)}", *_format_head(described, function)]
        lines += [] if own is None else [f"*SSTX {own}"]
        lines += [f'  EINHEIT_X "{to_tool_unit(curve.axis.unit)}"']
        lines += [f'  EINHEIT_W "{to_tool_unit(curve.unit)}"']
        lines += [
            *_format_list("ST/X", curve.axis.points),
            *_format_list("WERT", curve.values),
            "END",
            "",
        ]
    return "\n".join(lines)


def _name_common_axes(content: ParameterSet) -> dict[Axis, str]:
    """Name the axes that several curves share."""
    counts = Counter(one.axis for one in content.curves)
    shared = [axis for axis, count in counts.items() if count > 1]
    return {axis: f"{axis.name}_axis_{k + 1}" for k, axis in enumerate(shared)}


def _format_head(entry: Scalar | Curve, function: str) -> list[str]:
    return [f'  LANGNAME "{entry.text}"', f"  FUNKTION {function}"]


def _format_list(keyword: str, values: tuple[float, ...]) -> Iterator[str]:
    for start in range(0, len(values), _PER_LINE):
        yield f"  {keyword} " + " ".join(
            format_number(v) for v in values[start : start + _PER_LINE]
        )


def _parse_dcm(text: str, source: str) -> ParameterSet:
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
    for kind, rest, fields in _iterate_blocks(lines, source):
        label = rest.split(maxsplit=1)[0] if rest else ""
        if kind == "FUNKTIONEN":
            name = _parse_function_name(fields) or name
        elif kind == "FESTWERT" and "WERT" in fields:
            scalars.append(_parse_scalar(label, fields, source))
        elif kind in _CURVES and "WERT" in fields and "ST/X" in fields:
            curves.append(_parse_curve(label, fields, source))
        elif kind != "STUETZSTELLENVERTEILUNG":  # curves repeat the points of a common axis
            skipped.append(f"{kind} {label}")
    return ParameterSet(name, tuple(scalars), tuple(curves), skipped=tuple(skipped))


def _iterate_blocks(lines: list[str], source: str) -> Iterator[tuple[str, str, _Fields]]:
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


def _parse_function_name(fields: _Fields) -> str:
    quoted = re.findall(r'"([^"]*)"', fields.get("FKT", [""])[0])
    return quoted[-1] if quoted else ""


def _parse_string(fields: _Fields, keyword: str) -> str:
    return fields.get(keyword, [""])[0].strip().strip('"')


def _parse_numbers(fields: _Fields, keyword: str, label: str, source: str) -> tuple[float, ...]:
    words = " ".join(fields[keyword]).split()
    return tuple(parse_finite(word, source, label) for word in words)


def _parse_scalar(label: str, fields: _Fields, source: str) -> Scalar:
    value = parse_finite(fields["WERT"][0], source, label)
    return Scalar(
        label,
        value,
        parse_tool_unit(_parse_string(fields, "EINHEIT_W")),
        _parse_string(fields, "LANGNAME"),
    )


def _parse_curve(label: str, fields: _Fields, source: str) -> Curve:
    text, over = split_axis(_parse_string(fields, "LANGNAME"))
    axis = Axis(
        over,
        _parse_numbers(fields, "ST/X", label, source),
        parse_tool_unit(_parse_string(fields, "EINHEIT_X")),
    )
    labels = (parse_tool_unit(_parse_string(fields, "EINHEIT_W")), text)
    return build_curve(label, axis, _parse_numbers(fields, "WERT", label, source), labels, source)


CODEC = Codec(_write_dcm, _parse_dcm, to_dotted_name, to_ascii_line)
