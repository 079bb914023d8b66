# SPDX-License-Identifier: MIT
"""Parameters as CSV for spreadsheets: one row per number, a curve as rows of one name.

name,axis,at,axis_unit,value,unit,text
"""

from __future__ import annotations

import csv
import io
from itertools import groupby, takewhile
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
from drivetwin.export.parameters.spelling import free_name, one_line

_COLUMNS = ("name", "axis", "at", "axis_unit", "value", "unit", "text")
_TITLE = "# Parameters of "

_Row = dict[str, str]


def legal_for_csv(parameters: ParameterSet) -> ParameterSet:
    """The set as the format can hold it."""
    return legal(parameters, free_name, one_line)


def csv_text(parameters: ParameterSet) -> str:
    """Contents of the file."""
    content = legal_for_csv(parameters)
    out = io.StringIO()
    for line in (f"{_TITLE}{content.name}", *(f"# {note}" for note in content.notes)):
        out.write(f"{line}\n")
    table = csv.writer(out, lineterminator="\n")
    table.writerow(_COLUMNS)
    for one in content.scalars:
        table.writerow((one.name, "", "", "", number(one.value), one.unit, one.text))
    for curve in content.curves:
        axis = curve.axis
        for at, value in zip(axis.points, curve.values, strict=True):
            point = (curve.name, axis.name, number(at), axis.unit, number(value))
            table.writerow((*point, curve.unit, curve.text))
    return out.getvalue()


def parse_csv(text: str, source: str) -> ParameterSet:
    """Read the file. Raises FileFormatError where columns are missing or a row is damaged."""
    lines = text.splitlines()
    head = list(takewhile(lambda line: line.startswith("#"), lines))
    named = next((line for line in head if line.startswith(_TITLE)), "")
    rows = csv.DictReader(lines[len(head) :], strict=True)
    scalars, curves = [], []
    for name, group in groupby(_rows(rows, source), key=lambda row: row["name"]):
        members = list(group)
        if members[0]["axis"]:
            curves.append(_curve(name, members, source))
        else:
            scalars += [_scalar(row, source) for row in members]
    title = named.removeprefix(_TITLE) if named else Path(source).stem
    return ParameterSet(title, tuple(scalars), tuple(curves))


def _rows(reader: csv.DictReader[str], source: str) -> list[_Row]:
    try:
        rows = list(reader)
    except csv.Error as fault:
        raise FileFormatError(f"no CSV: {fault}", "correct it", Where(file=source)) from None
    if tuple(reader.fieldnames or ()) != _COLUMNS:
        raise FileFormatError(
            f"the columns are not {','.join(_COLUMNS)}",
            "hand in a file as `drivetwin export` writes it",
            Where(file=source),
        )
    for row in rows:
        if None in row or None in row.values():
            raise FileFormatError(
                f"a row does not have {len(_COLUMNS)} columns",
                "separate columns by commas and quote texts that hold some",
                Where(file=source, key=row["name"]),
            )
    return rows


def _scalar(row: _Row, source: str) -> Scalar:
    return Scalar(row["name"], finite(row["value"], source, row["name"]), row["unit"], row["text"])


def _curve(name: str, rows: list[_Row], source: str) -> Curve:
    first = rows[0]
    return curve_of(
        name,
        Axis(
            first["axis"],
            tuple(finite(row["at"], source, name) for row in rows),
            first["axis_unit"],
        ),
        (finite(row["value"], source, name) for row in rows),
        (first["unit"], first["text"]),
        source,
    )
