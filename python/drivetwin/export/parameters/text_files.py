# SPDX-License-Identifier: MIT
"""Parameters as text: CSV for spreadsheets, MATLAB script (.m), DCM of calibration tools.

CSV has one row per number, a curve as rows of one name: name,axis,at,axis_unit,value,unit,text.
The script has one variable per number, a vector pair per curve, units in the comments: a curve
`mu_B3` has its breakpoints in `mu_B3_slip`. It is read back line by line, not run.

ETAS DCM (Konservierungsformat 2.0) is read by INCA, CANape and MDA. Keywords are German and at line
starts; texts are 7-bit in double quotes; a name is a letter or `_` and letters, digits, `_`,
`.` and brackets; lists break after six numbers.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby, takewhile
from pathlib import Path

from drivetwin._util.text import NumberText, format_csv_row, parse_csv_row, restore_cell
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
    to_flat_name,
    to_free_name,
    to_one_line,
    to_tool_unit,
)

_COLUMNS = ("name", "axis", "at", "axis_unit", "value", "unit", "text")
_CSV_TITLE = "# Parameters of "

_Row = dict[str, str]


def _write_csv(content: ParameterSet) -> str:
    heads = (f"{_CSV_TITLE}{content.name}", *(f"# {note}" for note in content.notes))
    rows: list[tuple[object, ...]] = [*((head,) for head in heads), _COLUMNS]
    for one in content.scalars:
        rows.append((one.name, "", "", "", _to_cell(one.value), one.unit, one.text))
    for curve in content.curves:
        axis = curve.axis
        for at, value in zip(axis.points, curve.values, strict=True):
            point = (curve.name, axis.name, _to_cell(at), axis.unit, _to_cell(value))
            rows.append((*point, curve.unit, curve.text))
    return "".join(map(format_csv_row, rows))


def _parse_csv(text: str, source: str) -> ParameterSet:
    """Read the file. Raises FileFormatError where columns are missing or a row is damaged."""
    lines = text.splitlines()
    head = list(takewhile(lambda line: line.startswith(("#", '"#')), lines))
    heads = ["".join(parse_csv_row(line)[:1]) if line[0] == '"' else line for line in head]
    named = next((line for line in heads if line.startswith(_CSV_TITLE)), "")
    rows = csv.DictReader(lines[len(head) :], strict=True)
    scalars, curves = [], []
    for name, group in groupby(_read_rows(rows, source), key=lambda row: row["name"]):
        members = list(group)
        if members[0]["axis"]:
            curves.append(_parse_curve(name, members, source))
        else:
            scalars += [_parse_scalar(row, source) for row in members]
    title = named.removeprefix(_CSV_TITLE) if named else Path(source).stem
    return ParameterSet(title, tuple(scalars), tuple(curves))


def _read_rows(reader: csv.DictReader[str], source: str) -> list[_Row]:
    try:
        rows = list(reader)
    except csv.Error as fault:
        raise FileFormatError(f"no CSV: {fault}", "correct it", Where(file=source)) from None
    if tuple(reader.fieldnames or ()) != _COLUMNS:
        raise FileFormatError(
            f"the columns are not {','.join(_COLUMNS)}",
            "hand in a file as 'drivetwin export' writes it",
            Where(file=source),
        )
    for row in rows:
        if None in row or None in row.values():
            raise FileFormatError(
                f"a row does not have {len(_COLUMNS)} columns",
                "separate columns by commas and quote texts that hold some",
                Where(file=source, key=row["name"]),
            )
    return [{key: restore_cell(text) for key, text in row.items()} for row in rows]


def _to_cell(value: float) -> NumberText:
    return NumberText(format_number(value))


def _parse_scalar(row: _Row, source: str) -> Scalar:
    return Scalar(
        row["name"], parse_finite(row["value"], source, row["name"]), row["unit"], row["text"]
    )


def _parse_curve(name: str, rows: list[_Row], source: str) -> Curve:
    first = rows[0]
    return build_curve(
        name,
        Axis(
            first["axis"],
            tuple(parse_finite(row["at"], source, name) for row in rows),
            first["axis_unit"],
        ),
        (parse_finite(row["value"], source, name) for row in rows),
        (first["unit"], first["text"]),
        source,
    )


CSV_CODEC = Codec(_write_csv, _parse_csv, to_free_name, to_one_line)


_MATLAB_TITLE = "%% Parameters of "
_LINE = re.compile(r"(\w+)\s*=\s*([^;%]+);\s*(?:%\s*\[([^\]]*)\]\s*(.*))?")
_BREAKPOINTS = re.compile(r"breakpoints (\w+) of (\w+)")


def _make_breakpoints_name(curve: Curve) -> str:
    return to_flat_name(f"{curve.name}_{curve.axis.name}")


def _write_m(content: ParameterSet) -> str:
    lines = [f"{_MATLAB_TITLE}{content.name}", *(f"% {note}" for note in content.notes), ""]
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
        if line.startswith(_MATLAB_TITLE):
            name = line.removeprefix(_MATLAB_TITLE)
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


MATLAB_CODEC = Codec(_write_m, _parse_m, to_flat_name, to_ascii_line, _make_breakpoints_name)


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
    common = content.name_common_axes()
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
            scalars.append(_parse_dcm_scalar(label, fields, source))
        elif kind in _CURVES and "WERT" in fields and "ST/X" in fields:
            curves.append(_parse_dcm_curve(label, fields, source))
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


def _parse_dcm_scalar(label: str, fields: _Fields, source: str) -> Scalar:
    value = parse_finite(fields["WERT"][0], source, label)
    return Scalar(
        label,
        value,
        parse_tool_unit(_parse_string(fields, "EINHEIT_W")),
        _parse_string(fields, "LANGNAME"),
    )


def _parse_dcm_curve(label: str, fields: _Fields, source: str) -> Curve:
    text, over = split_axis(_parse_string(fields, "LANGNAME"))
    axis = Axis(
        over,
        _parse_numbers(fields, "ST/X", label, source),
        parse_tool_unit(_parse_string(fields, "EINHEIT_X")),
    )
    labels = (parse_tool_unit(_parse_string(fields, "EINHEIT_W")), text)
    return build_curve(label, axis, _parse_numbers(fields, "WERT", label, source), labels, source)


DCM_CODEC = Codec(_write_dcm, _parse_dcm, to_dotted_name, to_ascii_line)
