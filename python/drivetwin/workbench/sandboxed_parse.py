# SPDX-License-Identifier: MIT
"""Parsing of a user's files in a child process with a limit on its memory.

A file of a few kilobytes may claim gigabytes. Then the child fails, not the program.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.child_process import limit_memory
from drivetwin.authoring.log_survey import (
    LogSurvey,
    find_pressure_columns,
    name_pressures,
    survey_log,
)
from drivetwin.channels.mapping import Mapped, combine_specs
from drivetwin.channels.mapping_file import format_mapping, read_mapping
from drivetwin.channels.roles import get_element
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import Proposal, propose_time_units
from drivetwin.errors import DrivetwinError, InputError, UnitError
from drivetwin.findings import Finding
from drivetwin.logs.formats.detect import open_recording, open_stated
from drivetwin.logs.formats.guarded import compute_parser_limits
from drivetwin.logs.read import read_log
from drivetwin.logs.survey import Survey, find_shortest_step, survey_recording
from drivetwin.plausibility.check import check_card, drop_card_findings, select_card_findings
from drivetwin.shifts.detect import FoundShifts, detect_shifts
from drivetwin.vehicle.card import RatioCard, VehicleCard, is_ratio_card, load_card, load_ratio_card
from drivetwin.workbench.forms import Corrections
from drivetwin.workbench.jobs import Emit


@dataclass(frozen=True, eq=False)
class Opened:
    """Contents of a log, and the mapping it was read with.

    `card` is None as long as none is open: pressures then have the labels of their columns.
    `ratios` is a card of the ratios alone, of a bus log; `card` and `found` are then None.
    `log` and `found` are None if the log cannot be read as mapped; `fault` then holds the reason.
    `found` is also None without a card. `doubts` are the implausible entries of the card.
    `time_units` are proposed where the file names no unit of time.
    """

    survey: Survey
    card: VehicleCard | None = None
    log: ShiftLog | None = None
    found: FoundShifts | None = None
    doubts: tuple[Finding, ...] = ()
    fault: str = ""
    time_units: tuple[Proposal, ...] = ()
    ratios: RatioCard | None = None


@dataclass(frozen=True)
class Request:
    """Files to open, and the user's corrections of the mapping.

    The labels name the files in messages and results; without a card `card` is None. `beside` is
    True for a mapping that was found beside the log.
    """

    log: Path
    label: str
    card: Path | None = None
    card_label: str = ""
    mapping: Path | None = None
    beside: bool = False
    corrections: Corrections = field(default_factory=Corrections)


@dataclass(frozen=True)
class ColumnKey:
    """A column of a log: name, group, and its number among those of the same name and group."""

    name: str
    group: str
    number: int = 0


@dataclass(frozen=True, eq=False)
class Preview:
    """A column as recorded: `time` (n,) [s], `values` (n,) in `unit`."""

    name: str
    unit: str
    time: FloatArray
    values: FloatArray


def open_log(emit: Emit, request: Request, scratch: Path) -> None:
    """Read card, columns and log, and find the shifts; emits one Opened.

    `scratch` is a file of our own for the corrected mapping. Raises the errors of card and file;
    those of the mapping become `fault`, so that it can be corrected.
    """
    limit_memory(compute_parser_limits(request.log).memory)
    with _apply_labels(_get_labels(request)):
        card, ratios = _load_card(request)
        stated = _read_stated(request, card)
        try:
            looked, names, stated, _ = _survey(request.log, card, stated)
        except UnitError as error:
            if stated.options.time.unit is not None:
                raise
            opened = _open_without_time_unit(request.log, card, stated)
            fault = _apply_labels_to(error, _get_labels(request))
            emit(replace(opened, fault=fault.format_for_shell(), ratios=ratios))
            return
    try:
        with _apply_labels(_get_labels(request)):
            mapping = _write_mapping(scratch, stated)
            read = read_log(request.log, names, mapping, gearing=card is not None)
            findings = (*stated.findings, *read.findings)
            log = replace(read, source=request.label, mappings={}, findings=findings)
            if card is None:
                log = replace(log, findings=drop_card_findings(log.findings))
            found = None if card is None else detect_shifts(log, card)
    except InputError as error:
        emit(Opened(looked, card, fault=error.format_for_shell(), ratios=ratios))
        return
    doubts = () if card is None or found is None else _check_card(card, log, found)
    emit(Opened(looked, card, log, found, doubts, ratios=ratios))


def _survey(
    path: Path, card: VehicleCard | None, stated: Mapped
) -> tuple[Survey, VehicleCard, Mapped, float]:
    """Survey a log; return also card and mapping with names for the pressures, and the time step.

    Without a card pressures are named after their columns.
    """
    with open_recording(path, stated.options) as recording:
        names = card
        if names is None:
            specs = find_pressure_columns(recording.columns, stated)
            names, stated = name_pressures(specs, stated)
        survey = survey_recording(recording, str(path), names, stated)
        return survey, names, stated, find_shortest_step(recording)


def _open_without_time_unit(path: Path, card: VehicleCard | None, stated: Mapped) -> Opened:
    """Survey a log in numbers of its time column, so that the unit can be stated."""
    options = replace(stated.options, time=replace(stated.options.time, unit="s"))
    survey, _, _, step = _survey(path, card, replace(stated, options=options))
    survey = replace(survey, options=stated.options)
    return Opened(survey, card, time_units=propose_time_units(step))


def read_column(emit: Emit, request: Request, key: ColumnKey) -> None:
    """Read a column of a log, mapped or not; emits a Preview.

    Raises InputError where the column holds no numbers.
    """
    limit_memory(compute_parser_limits(request.log).memory)
    with (
        _apply_labels(_get_labels(request)),
        open_recording(request.log, _read_stated(request, None).options) as recording,
    ):
        places = [
            place
            for place, one in enumerate(recording.columns)
            if (one.name, one.group) == (key.name, key.group)
        ]
        if key.number >= len(places):
            raise InputError("there is no such column", "choose one that is listed")
        channel = recording.load(places[key.number])
    known = np.isfinite(channel.time)
    time, values = channel.time[known], channel.values[known]
    emit(Preview(channel.name, channel.unit or "", time, values))


def make_column_key(survey: Survey, index: int) -> ColumnKey:
    """Return the key of a column of a survey. Raises InputError where it has none there."""
    if not 0 <= index < len(survey.columns):
        raise InputError("there is no such column", "choose one that is listed")
    names = [(one.name, one.group) for one in survey.columns]
    return ColumnKey(*names[index], names[:index].count(names[index]))


def survey_for_card(emit: Emit, request: Request, scratch: Path) -> None:
    """Read what a log shows of a vehicle, without a card; emits a LogSurvey."""
    limit_memory(compute_parser_limits(request.log).memory)
    with _apply_labels(_get_labels(request)):
        survey: LogSurvey = survey_log(
            request.log, read_mapping(_write_mapping(scratch, _read_stated(request, None)))
        )
    emit(replace(survey, log=replace(survey.log, source=request.label, mappings={})))


def _get_labels(request: Request) -> dict[Path, str]:
    labels = {request.log: request.label}
    return labels if request.card is None else {**labels, request.card: request.card_label}


def _load_card(request: Request) -> tuple[VehicleCard | None, RatioCard | None]:
    """Load the card of the request: of a vehicle, or of the ratios alone."""
    if request.card is None:
        return None, None
    if is_ratio_card(request.card):
        return None, replace(load_ratio_card(request.card), source=request.card_label)
    return replace(load_card(request.card), source=request.card_label), None


def _read_stated(request: Request, card: VehicleCard | None) -> Mapped:
    """Read the mapping file with the corrections, those of elements that a card lacks left out."""
    stated = _read_mapping(request)
    corrected = {
        role: spec
        for role, spec in request.corrections.channels.items()
        if card is None or (element := get_element(role)) is None or element in card.elements
    }
    ignored = tuple(dict.fromkeys((*stated.options.ignored, *request.corrections.ignored)))
    time = stated.options.time
    time = replace(time, unit=request.corrections.time_unit or time.unit)
    return replace(
        stated,
        channels=combine_specs(stated.channels, corrected, request.corrections.ignored),
        options=replace(stated.options, ignored=ignored, time=time),
    )


def _read_mapping(request: Request) -> Mapped:
    """Read the mapping file; one beside the log that fits no column gives a finding alone."""
    if request.mapping is None:
        return Mapped({})
    stated = replace(read_mapping(request.mapping), beside=request.beside)
    if request.beside:
        with suppress(UnitError), open_stated(request.log, stated) as (_, fitting):
            return fitting
    return stated


def _check_card(card: VehicleCard, log: ShiftLog, found: FoundShifts) -> tuple[Finding, ...]:
    """Return the implausible entries of the card; those of the log alone where that fails."""
    remarks = select_card_findings(card, log.findings)
    try:
        return (*check_card(card, log, found.shifts), *remarks)
    except DrivetwinError:
        return (*check_card(card), *remarks)


@contextmanager
def _apply_labels(labels: Mapping[Path, str]) -> Iterator[None]:
    """Replace paths in errors by the files' labels, because uploads have internal names."""
    try:
        yield
    except DrivetwinError as error:
        raise _apply_labels_to(error, labels) from None


def _apply_labels_to(error: DrivetwinError, labels: Mapping[Path, str]) -> InputError:
    """Return the error with labels in place of paths."""
    what, file = error.what, error.where.file
    for path, label in labels.items():
        what = what.replace(str(path), label)
        file = label if file == str(path) else file
    return InputError(what, error.remedy, replace(error.where, file=file))


def _write_mapping(path: Path, stated: Mapped) -> Path:
    text = format_mapping(stated.channels, stated.options, stated.names)
    path.write_text(text, encoding="utf-8")
    return path
