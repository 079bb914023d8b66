# SPDX-License-Identifier: MIT
"""The formats of parameter files, by name and by the ending of the file."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from drivetwin._util.atomic import LARGEST_RECORD, measure_regular_file, write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin.errors import FileFormatError, InputError, Where
from drivetwin.export.parameters import cdfx, csv_file, dcm, matlab, ssv
from drivetwin.export.parameters.content import ParameterSet, choose_unit, round_to, state_bounds


class ParameterFormat(StrEnum):
    """A format; its value is also the ending of its files."""

    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    CSV = "csv"


CODECS = {
    ParameterFormat.SSV: ssv.CODEC,
    ParameterFormat.CDFX: cdfx.CODEC,
    ParameterFormat.DCM: dcm.CODEC,
    ParameterFormat.M: matlab.CODEC,
    ParameterFormat.CSV: csv_file.CODEC,
}


_AXIS = 1e-6
"""Resolution of the breakpoints of a rounded curve, over the largest: well below any sample."""
_FOR_PEOPLE = (ParameterFormat.CDFX, ParameterFormat.DCM)
"""Formats of calibration tools, in which people read and edit numbers."""


def show_units(content: ParameterSet, kind: ParameterFormat) -> ParameterSet:
    """Return the contents as people read a format: bar and rpm, else SI, rounded, with bounds."""
    if kind not in _FOR_PEOPLE:
        return content
    scalars = []
    for one in content.scalars:
        unit, factor = choose_unit(one.unit)
        value = round_to(one.value * factor, one.resolution * factor)
        scalars.append(replace(one, value=value, unit=unit, text=state_bounds(one, factor)))
    curves = []
    for curve in content.curves:
        unit, factor = choose_unit(curve.unit)
        along, scale = choose_unit(curve.axis.unit)
        fine = _AXIS * scale * max(map(abs, curve.axis.points)) if curve.resolution else 0.0
        points = tuple(round_to(scale * x, fine) for x in curve.axis.points)
        axis = replace(curve.axis, points=points, unit=along)
        values = tuple(round_to(factor * one, curve.resolution * factor) for one in curve.values)
        text = state_bounds(curve, factor)
        curves.append(replace(curve, axis=axis, values=values, unit=unit, text=text))
    return replace(content, scalars=tuple(scalars), curves=tuple(curves))


@check_arguments
def write_parameters(parameters: ParameterSet, path: Path, kind: ParameterFormat) -> None:
    """Write a parameter file; it appears whole or not at all.

    Raises InputError where two names become one in the format, and OSError.
    """
    write_text(path, CODECS[kind].text(parameters))


@check_arguments
def read_parameters(path: Path, kind: ParameterFormat | None = None) -> ParameterSet:
    """Read a parameter file, by default in the format that its ending names.

    What is neither a number nor a curve is named in `skipped`. Raises FileFormatError where the
    file is damaged, InputError for an unknown ending and what is no regular file, OSError.
    """
    chosen = kind or _select_format(path)
    return CODECS[chosen].parse(_read_decoded(path), path.name)


def _select_format(path: Path) -> ParameterFormat:
    try:
        return ParameterFormat(path.suffix.removeprefix(".").lower())
    except ValueError:
        raise InputError(
            f"{path.suffix or 'no ending'!r} names no parameter format",
            f"use one of {', '.join(ParameterFormat)}",
            Where(file=path.name),
        ) from None


def _read_decoded(path: Path) -> str:
    """Text in UTF-8 or, as older tools write, Latin-1."""
    measure_regular_file(path, InputError, largest=LARGEST_RECORD)
    data = path.read_bytes()
    if b"\0" in data:
        raise FileFormatError(
            "the file is binary", "hand in a parameter file", Where(file=path.name)
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
