# SPDX-License-Identifier: MIT
"""Files that commands read: their kind by content, the mapping and the card of a log."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from drivetwin._util.request import FileRole
from drivetwin._util.toml import MAX_SIZE, parse_toml
from drivetwin.channels.mapping import RECALLED, Mapped
from drivetwin.channels.mapping_file import read_mapping, read_project_mapping
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.options import TWIN
from drivetwin.cli.output import show_findings, show_step
from drivetwin.errors import CardError, FileFormatError, InputError, ResultFileError, Where
from drivetwin.files.records import dump_findings
from drivetwin.logs.formats.detect import is_binary_log
from drivetwin.logs.raw import HEAD_BYTES
from drivetwin.logs.read import read_log
from drivetwin.report.blocks import Block, build_findings_section, make_notes
from drivetwin.shifts.detect import FoundShifts, find_causes
from drivetwin.shifts.summary import list_remarks
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.card import VehicleCard, load_card


def find_logs(name: str, logs: Sequence[Path]) -> list[int]:
    """Find the places of the logs of a name, with or without folder and ending."""
    return [k for k, log in enumerate(logs) if name in (str(log), log.name, log.stem)]


def find_mapping(channels: Path | None, log: Path) -> Mapped:
    """Read the mapping file that was given, else `channels.toml` beside the log, if any."""
    return read_project_mapping(log) if channels is None else read_mapping(channels)


def read_twin_log(
    twin: Twin, log: Path, vehicle: Path | None = None, channels: Path | None = None
) -> tuple[ShiftLog, VehicleCard]:
    """Read a log for use with a twin, and the card in the file `vehicle` or the twin's own.

    Both cards remember the channel mapping of the twin; units and options that come from it are
    shown. Raises the typed errors of the readers.
    """
    card = twin.build_card()
    if vehicle is not None:
        card = replace(load_card(vehicle), remembered=twin.mapping)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, card, find_mapping(channels, log))
    show_findings(one for one in recording.findings if one.code in RECALLED)
    return recording, card


def build_log_remarks(
    log: ShiftLog, card: VehicleCard, found: FoundShifts
) -> tuple[list[Block], dict[str, Any]]:
    """Build remarks on the shifts of a log and its findings, and the document of both.

    Findings that `read_twin_log` shows are left out.
    """
    noted = (*log.findings, *find_causes(log, card))
    findings = tuple(one for one in noted if one.code not in RECALLED)
    blocks = make_notes("Remarks on shifts", list_remarks(found))
    document = {"rejected": found.rejected, "findings": dump_findings(findings)}
    return [*blocks, *build_findings_section(findings).blocks], document


_TOML_LINE = re.compile(r"""^\s*(?:[\w."'-]+\s*=|\[+[\w."' -]+\]+\s*(?:#.*)?$)""")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_MAKE_TWIN = "'drivetwin identify LOG --vehicle CARD -o DIR' writes the twin, DIR/twin.toml"
_REMEDIES: dict[FileRole, dict[FileRole, str]] = {
    FileRole.TWIN: {
        FileRole.LOG: f"give the twin first, then the log; {_MAKE_TWIN}",
        FileRole.CARD: f"identify with this card first: {_MAKE_TWIN}",
        FileRole.MAPPING: f"give the mapping with --channels; {_MAKE_TWIN}",
    },
    FileRole.LOG: {
        FileRole.TWIN: "give a log here; where a command takes both, the twin comes first",
        FileRole.RESULT: "give the log that was identified, or another one",
        FileRole.CARD: "give the card with --vehicle, and a log here",
        FileRole.MAPPING: "give the mapping with --channels, and a log here",
    },
    FileRole.CARD: {
        FileRole.LOG: "give the log as an argument, and the card with --vehicle",
        FileRole.TWIN: "give the card of the vehicle; commands that take a twin need no card",
        FileRole.RESULT: "give the card of the vehicle; commands that take a twin need no card",
        FileRole.MAPPING: "give the mapping with --channels, and the card with --vehicle",
    },
}
_FAMILIES = {
    **dict.fromkeys(("twin", "tcu-twin"), FileRole.TWIN),
    **dict.fromkeys(("result", "bus", "fit", "tcu"), FileRole.RESULT),
}
"""Roles of the files that commands wrote, by the family of their schema."""
_ERRORS: dict[FileRole, type[InputError]] = {
    FileRole.TWIN: ResultFileError,
    FileRole.LOG: FileFormatError,
    FileRole.CARD: CardError,
}


def resolve_file(path: Path, role: FileRole) -> Path:
    """Return the path of a file that is read; a twin may be named by its folder or its result.

    Raises InputError if the content of the file shows that it has another role.
    """
    if role is FileRole.TWIN:
        return find_twin(path)
    if role is FileRole.RESULT and path.is_file():
        return path if recognise_file(path) is FileRole.RESULT else find_twin(path)
    if role in _REMEDIES:
        require_kind(path, role)
    return path


def find_twin(source: Path) -> Path:
    """Return the twin file of a source: the file itself, or that of an output folder or result.

    Raises ResultFileError if the source is another kind of file, or has no twin.
    """
    if source.is_dir():
        path = source / TWIN
    elif recognise_file(source) is FileRole.RESULT:
        path = source.with_name(TWIN)
    else:
        require_kind(source, FileRole.TWIN)
        return source
    if not path.is_file():
        from drivetwin.report.results import open_result

        open_result(source).load_twin()  # raises with the reason
    return path


def require_kind(path: Path, wanted: FileRole) -> None:
    """Raise an InputError if the content of a file shows that it is of another kind.

    A file that is missing, damaged or not recognised passes: its reader names the fault.
    """
    found = recognise_file(path)
    remedy = _REMEDIES[wanted].get(found)
    if remedy is not None:
        raise _ERRORS[wanted](f"this is {found}, not {wanted}", remedy, Where(file=str(path)))


def recognise_file(path: Path) -> FileRole:
    """Recognise the kind of a file from its content; its name does not matter."""
    if not path.is_file():
        return FileRole.OTHER
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if is_binary_log(head):
        return FileRole.LOG
    text = head.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith("{"):
        return _recognise_document(path, json.loads)
    lines = text.splitlines()
    if any(_TOML_LINE.match(line) for line in lines):
        return _recognise_document(path, parse_toml)
    return FileRole.LOG if any(map(_is_data_row, lines)) else FileRole.OTHER


def _recognise_document(path: Path, parse: Any) -> FileRole:
    """Recognise a TOML or JSON file by its keys; one that cannot be parsed is unknown."""
    if path.stat().st_size > MAX_SIZE:
        return FileRole.OTHER
    try:
        tree = parse(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError):
        return FileRole.OTHER
    if not isinstance(tree, dict):
        return FileRole.OTHER
    schema = str(tree.get("schema", ""))
    family = schema.removeprefix("drivetwin/").rpartition("-")[0]
    if family in _FAMILIES:
        return _FAMILIES[family]
    if {"gears", "elements"} <= tree.keys() and not schema:
        return FileRole.CARD
    is_mapping = "channels" in tree and tree.keys() <= {"channels", "time", "bus"}
    return FileRole.MAPPING if is_mapping else FileRole.OTHER


def _is_data_row(line: str) -> bool:
    """Return whether a line holds two numbers or more and nothing else."""
    fields = [field for field in re.split(r"[;,\t ]+", line.strip()) if field]
    return len(fields) > 1 and all(_NUMBER.fullmatch(field) for field in fields)
