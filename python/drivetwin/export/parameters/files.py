# SPDX-License-Identifier: MIT
"""The formats of parameter files, by name and by the ending of the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.regular_file import LARGEST_RECORD, measure_regular_file
from drivetwin.errors import FileFormatError, InputError, Where
from drivetwin.export.parameters.cdfx import convert_for_cdfx, format_cdfx, parse_cdfx
from drivetwin.export.parameters.content import ParameterSet
from drivetwin.export.parameters.csv_file import convert_for_csv, format_csv, parse_csv
from drivetwin.export.parameters.dcm import convert_for_dcm, format_dcm, parse_dcm
from drivetwin.export.parameters.json_file import convert_for_json, format_json, parse_json
from drivetwin.export.parameters.matlab import convert_for_m, format_m, parse_m
from drivetwin.export.parameters.ssv import convert_for_ssv, format_ssv, parse_ssv


class ParameterFormat(StrEnum):
    """A format; its value is also the ending of its files."""

    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    JSON = "json"
    CSV = "csv"


@dataclass(frozen=True)
class Codec:
    """A format as functions: contents of a file, their inverse, and what the format can hold.

    `parse` takes the text and the name of its file and raises FileFormatError; `legal` returns the
    set with names and texts respelled, which is what reading gives back.
    """

    text: Callable[[ParameterSet], str]
    parse: Callable[[str, str], ParameterSet]
    legal: Callable[[ParameterSet], ParameterSet]


CODECS = {
    ParameterFormat.SSV: Codec(format_ssv, parse_ssv, convert_for_ssv),
    ParameterFormat.CDFX: Codec(format_cdfx, parse_cdfx, convert_for_cdfx),
    ParameterFormat.DCM: Codec(format_dcm, parse_dcm, convert_for_dcm),
    ParameterFormat.M: Codec(format_m, parse_m, convert_for_m),
    ParameterFormat.JSON: Codec(format_json, parse_json, convert_for_json),
    ParameterFormat.CSV: Codec(format_csv, parse_csv, convert_for_csv),
}


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
