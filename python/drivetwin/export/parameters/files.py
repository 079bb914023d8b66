# SPDX-License-Identifier: MIT
"""The formats of parameter files, by name and by the ending of the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin.errors import FileFormatError, InputError, Where
from drivetwin.export.parameters.cdfx import cdfx_text, legal_for_cdfx, parse_cdfx
from drivetwin.export.parameters.content import ParameterSet
from drivetwin.export.parameters.csv_file import csv_text, legal_for_csv, parse_csv
from drivetwin.export.parameters.dcm import dcm_text, legal_for_dcm, parse_dcm
from drivetwin.export.parameters.json_file import json_text, legal_for_json, parse_json
from drivetwin.export.parameters.matlab import legal_for_m, m_text, parse_m
from drivetwin.export.parameters.ssv import legal_for_ssv, parse_ssv, ssv_text


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
    ParameterFormat.SSV: Codec(ssv_text, parse_ssv, legal_for_ssv),
    ParameterFormat.CDFX: Codec(cdfx_text, parse_cdfx, legal_for_cdfx),
    ParameterFormat.DCM: Codec(dcm_text, parse_dcm, legal_for_dcm),
    ParameterFormat.M: Codec(m_text, parse_m, legal_for_m),
    ParameterFormat.JSON: Codec(json_text, parse_json, legal_for_json),
    ParameterFormat.CSV: Codec(csv_text, parse_csv, legal_for_csv),
}


def write_parameters(parameters: ParameterSet, path: Path, kind: ParameterFormat) -> None:
    """Write a parameter file; it appears whole or not at all.

    Raises InputError where two names become one in the format, and OSError.
    """
    write_text(path, CODECS[kind].text(parameters))


def read_parameters(path: Path, kind: ParameterFormat | None = None) -> ParameterSet:
    """Read a parameter file, by default in the format that its ending names.

    What is neither a number nor a curve is named in `skipped`. Raises FileFormatError where the
    file is damaged, InputError for an unknown ending, and OSError.
    """
    chosen = kind or _by_ending(path)
    return CODECS[chosen].parse(_decoded(path), path.name)


def _by_ending(path: Path) -> ParameterFormat:
    try:
        return ParameterFormat(path.suffix.removeprefix(".").lower())
    except ValueError:
        raise InputError(
            f"{path.suffix or 'no ending'!r} names no parameter format",
            f"use one of {', '.join(ParameterFormat)}",
            Where(file=path.name),
        ) from None


def _decoded(path: Path) -> str:
    """Text in UTF-8 or, as older tools write, Latin-1."""
    data = path.read_bytes()
    if b"\0" in data:
        raise FileFormatError(
            "the file is binary", "hand in a parameter file", Where(file=path.name)
        )
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
