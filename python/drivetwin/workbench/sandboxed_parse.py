# SPDX-License-Identifier: MIT
"""Parsing of a user's files in a child process with a limit on its memory.

A file of a few kilobytes may claim gigabytes. Then the child fails, not the program.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin._util.process_limits import limit_memory
from drivetwin.channels.channel_spec import ChannelSpec
from drivetwin.channels.mapping import Mapped
from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.mapping_text import format_mapping
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError, InputError
from drivetwin.gearbox import load_gearbox
from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.formats.parser_limits import compute_parser_limits
from drivetwin.logs.read import read_log
from drivetwin.logs.survey import Survey, survey_recording
from drivetwin.shifts.detect import FoundShifts, detect_shifts
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.workbench.jobs import Emit


@dataclass(frozen=True, eq=False)
class Opened:
    """Contents of a log, and the mapping it was read with.

    `log` and `found` are None if the log cannot be read as mapped; `fault` then holds the reason.
    """

    survey: Survey
    card: VehicleCard
    log: ShiftLog | None = None
    found: FoundShifts | None = None
    fault: str = ""


@dataclass(frozen=True)
class Request:
    """Files to open, and the channels as corrected by the user.

    The labels name the files in messages and results.
    """

    log: Path
    label: str
    card: Path
    card_label: str
    mapping: Path | None = None
    channels: Mapping[str, ChannelSpec] = field(default_factory=dict)


def open_log(emit: Emit, request: Request, scratch: Path) -> None:
    """Read card, columns and log, and find the shifts; emits one Opened.

    `scratch` is a file of our own for the corrected mapping. Raises the errors of card and file;
    those of the mapping become `fault`, so that it can be corrected.
    """
    limit_memory(compute_parser_limits(request.log).memory)
    labels = {request.log: request.label, request.card: request.card_label}
    with _apply_labels(labels):
        card = replace(load_card(request.card), source=request.card_label)
        stated = Mapped({}) if request.mapping is None else read_mapping(request.mapping)
        stated = replace(stated, channels={**stated.channels, **request.channels})
        with open_recording(request.log, stated.options) as recording:
            looked = survey_recording(recording, str(request.log), card, stated)
    try:
        with _apply_labels(labels):
            mapping = _write_mapping(scratch, stated)
            read = read_log(request.log, card, mapping)
            log = replace(read, source=request.label, mappings={})
            found = detect_shifts(log, card)
    except InputError as error:
        emit(Opened(looked, card, fault=str(error)))
        return
    emit(Opened(looked, card, log, found))


def open_gearbox(emit: Emit, path: Path, label: str) -> None:
    """Read a gearbox card, called `label` in messages; emits it. Raises CardError."""
    with _apply_labels({path: label}):
        emit(load_gearbox(str(path)))


@contextmanager
def _apply_labels(labels: Mapping[Path, str]) -> Iterator[None]:
    """Replace paths in errors by the files' labels, because uploads have internal names."""
    try:
        yield
    except DrivetwinError as error:
        what, file = error.what, error.where.file
        for path, label in labels.items():
            what = what.replace(str(path), label)
            file = label if file == str(path) else file
        raise InputError(what, error.remedy, replace(error.where, file=file)) from None


def _write_mapping(path: Path, stated: Mapped) -> Path:
    text = format_mapping(stated.channels, stated.options, stated.names)
    path.write_text(text, encoding="utf-8")
    return path
