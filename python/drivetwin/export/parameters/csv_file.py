# SPDX-License-Identifier: MIT
"""Parameters as CSV for spreadsheets: one row per number, a curve as rows of one name.

name,axis,at,axis_unit,value,unit,text
"""

from __future__ import annotations

import csv
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
    build_curve,
    format_number,
    parse_finite,
    to_free_name,
    to_one_line,
)

_COLUMNS = ("name", "axis", "at", "axis_unit", "value", "unit", "text")
_TITLE = "# Parameters of "

_Row = dict[str, str]


def _write_csv(content: ParameterSet) -> str:
    heads = (f"{_TITLE}{content.name}", *(f"# {note}" for note in content.notes))
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
    named = next((line for line in heads if line.startswith(_TITLE)), "")
    rows = csv.DictReader(lines[len(head) :], strict=True)
    scalars, curves = [], []
    for name, group in groupby(_read_rows(rows, source), key=lambda row: row["name"]):
        members = list(group)
        if members[0]["axis"]:
            curves.append(_parse_curve(name, members, source))
        else:
            scalars += [_parse_scalar(row, source) for row in members]
    title = named.removeprefix(_TITLE) if named else Path(source).stem
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


CODEC = Codec(_write_csv, _parse_csv, to_free_name, to_one_line)
