# SPDX-License-Identifier: MIT
"""Kind of a file by its content, for arguments that were swapped or mistaken."""

from __future__ import annotations

import json
import re
from enum import StrEnum
from pathlib import Path
from typing import Any

from drivetwin._util.toml import MAX_SIZE, parse_toml
from drivetwin.errors import CardError, FileFormatError, InputError, ResultFileError, Where

_HEAD = 8192
"""Number of bytes by which a log is recognised."""
_TOML_LINE = re.compile(r"""^\s*(?:[\w."'-]+\s*=|\[+[\w."' -]+\]+\s*(?:#.*)?$)""")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


class FileKind(StrEnum):
    """Kind of a file."""

    LOG = "a log"
    TWIN = "a twin"
    RESULT = "a result of an identification"
    CARD = "a vehicle card"
    MAPPING = "a channel mapping"
    UNKNOWN = "unknown"


_MAKE_TWIN = "'drivetwin identify LOG --vehicle CARD -o DIR' writes the twin, DIR/twin.toml"
_REMEDIES: dict[FileKind, dict[FileKind, str]] = {
    FileKind.TWIN: {
        FileKind.LOG: f"give the twin first, then the log; {_MAKE_TWIN}",
        FileKind.CARD: f"identify with this card first: {_MAKE_TWIN}",
        FileKind.MAPPING: f"give the mapping with --channels; {_MAKE_TWIN}",
    },
    FileKind.LOG: {
        FileKind.TWIN: "give a log here; where a command takes both, the twin comes first",
        FileKind.RESULT: "give the log that was identified, or another one",
        FileKind.CARD: "give the card with --vehicle, and a log here",
        FileKind.MAPPING: "give the mapping with --channels, and a log here",
    },
    FileKind.CARD: {
        FileKind.LOG: "give the log as an argument, and the card with --vehicle",
        FileKind.TWIN: "give the card of the vehicle; commands that take a twin need no card",
        FileKind.RESULT: "give the card of the vehicle; commands that take a twin need no card",
        FileKind.MAPPING: "give the mapping with --channels, and the card with --vehicle",
    },
}
_ERRORS: dict[FileKind, type[InputError]] = {
    FileKind.TWIN: ResultFileError,
    FileKind.LOG: FileFormatError,
    FileKind.CARD: CardError,
}


def require_kind(path: Path, wanted: FileKind) -> None:
    """Raise an InputError if the content of a file shows that it is of another kind.

    A file that is missing, damaged or not recognised passes: its reader names the fault.
    """
    found = recognise_file(path)
    remedy = _REMEDIES[wanted].get(found)
    if remedy is not None:
        raise _ERRORS[wanted](f"this is {found}, not {wanted}", remedy, Where(file=str(path)))


def recognise_file(path: Path) -> FileKind:
    """Recognise the kind of a file from its content; its name does not matter."""
    from drivetwin.logs.formats.detect import is_binary_log

    if not path.is_file():
        return FileKind.UNKNOWN
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if is_binary_log(head):
        return FileKind.LOG
    text = head.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith("{"):
        return _recognise_document(path, json.loads)
    lines = text.splitlines()
    if any(_TOML_LINE.match(line) for line in lines):
        return _recognise_document(path, parse_toml)
    return FileKind.LOG if any(map(_is_data_row, lines)) else FileKind.UNKNOWN


def _recognise_document(path: Path, parse: Any) -> FileKind:
    """Recognise a TOML or JSON file by its keys; one that cannot be parsed is unknown."""
    if path.stat().st_size > MAX_SIZE:
        return FileKind.UNKNOWN
    try:
        tree = parse(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError):
        return FileKind.UNKNOWN
    if not isinstance(tree, dict):
        return FileKind.UNKNOWN
    schema = str(tree.get("schema", ""))
    for name, kind in (("twin", FileKind.TWIN), ("result", FileKind.RESULT)):
        if schema.startswith(f"drivetwin/{name}-"):
            return kind
    if {"gears", "elements"} <= tree.keys() and not schema:
        return FileKind.CARD
    is_mapping = "channels" in tree and tree.keys() <= {"channels", "time", "bus"}
    return FileKind.MAPPING if is_mapping else FileKind.UNKNOWN


def _is_data_row(line: str) -> bool:
    """Return whether a line holds two numbers or more and nothing else."""
    fields = [field for field in re.split(r"[;,\t ]+", line.strip()) if field]
    return len(fields) > 1 and all(_NUMBER.fullmatch(field) for field in fields)
