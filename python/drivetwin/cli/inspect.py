# SPDX-License-Identifier: MIT
"""`drivetwin inspect LOG`: what a file holds and what each column would be taken for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin.authoring.log_survey import find_pressure_columns, name_pressures
from drivetwin.channels.mapping import Mapped, name_commands
from drivetwin.channels.mapping_file import Draft, format_mapping, read_mapping
from drivetwin.channels.roles import FOR_SHIFTS, ReadOptions, TimeColumn
from drivetwin.cli.input_files import find_mapping
from drivetwin.cli.output import print_line, show_step, to_error_document
from drivetwin.cli.requests.identification import Inspect
from drivetwin.errors import DrivetwinError, UnitError
from drivetwin.files.records import dump_findings
from drivetwin.findings import Code, Finding, report
from drivetwin.logs.formats.can.database import list_databases
from drivetwin.logs.formats.detect import name_project_mapping, open_stated
from drivetwin.logs.raw import Recording, Remembered
from drivetwin.logs.read import Demands, assemble_log
from drivetwin.logs.survey import (
    Column,
    Survey,
    draft_mapping,
    draft_unread,
    find_shortest_step,
    survey_recording,
)
from drivetwin.plausibility.check import drop_card_findings
from drivetwin.report.blocks import Block, Outcome, TextBlock, build_findings_section, make_notes
from drivetwin.report.inputs import build_column_table
from drivetwin.tcu.card import ControllerCard, is_controller_card, load_controller_card
from drivetwin.tcu.log import read_controller_log
from drivetwin.vehicle.card import VehicleCard, is_ratio_card, load_card


def inspect(request: Inspect) -> Outcome:
    """Survey a log, read it as the other commands do, and write the mapping."""
    log, write_mapping, accept = request.log, request.write_mapping, request.accept_proposals
    vehicle = request.vehicle
    stated, card, control = find_mapping(request.channels, log), None, None
    # A card of the ratios alone names no pressures, that of a gearbox control commanded ones.
    if vehicle is not None and is_controller_card(vehicle):
        control = load_controller_card(vehicle)
    elif vehicle is not None and not is_ratio_card(vehicle):
        card = load_card(vehicle)
    with show_step(f"reading {log.name}"):
        try:
            seen = _look_at(log, card, stated, control)
        except DrivetwinError as fault:
            if write_mapping is not None:
                _write_unread(write_mapping, card, stated, fault, list_databases(log))
            raise
        draft = draft_mapping(seen.survey, unnamed_step=seen.unnamed_step, accept=accept)
        if write_mapping is not None:
            found = seen.survey
            text = format_mapping(found.mapping, found.options, found.names, draft)
            write_text(write_mapping, text)
        if write_mapping is not None and accept:
            seen = _look_at(log, card, read_mapping(write_mapping), control)
            draft = draft_mapping(seen.survey, unnamed_step=seen.unnamed_step)
    error = None if seen.refusal is None else to_error_document(seen.refusal)["error"]
    remarks = {"findings": dump_findings(seen.findings), "refusal": error}
    document = seen.survey.to_document() | {"proposals": draft.proposed_units} | remarks
    files = () if write_mapping is None else (write_mapping,)
    return Outcome([*_build_seen(seen, draft, log.name)], document, files)


def _build_seen(seen: _Seen, draft: Draft, name: str) -> Iterator[Block]:
    """Build the columns of a log, notes, open units with their proposals, and findings."""
    found = seen.survey
    shown = _select_shown(found.columns)
    yield build_column_table(shown, f"Columns of {name}")
    notes = list(found.notes)
    if len(shown) < len(found.columns):
        more = len(found.columns) - len(shown)
        notes.insert(0, f"{more} more columns, all without a role: --json lists them")
    if draft.proposed_units:
        listed = ", ".join(
            f"{role} ({' or '.join(units) or 'no proposal'})"
            for role, units in draft.proposed_units.items()
        )
        notes.append(
            f"no usable unit, proposed from the values: {listed}; state it in a channel mapping: "
            "--write-mapping channels.toml writes one, with --accept-proposals with the units "
            "that are the only proposal"
        )
    yield from make_notes("Notes", notes)
    others = (one for one in seen.findings if one.names.get("text") not in found.notes)
    yield from build_findings_section(tuple(others)).blocks
    if seen.refusal is not None:
        proposed = isinstance(seen.refusal, UnitError) and draft.proposed_units
        reason = replace(seen.refusal, remedy="") if proposed else seen.refusal
        yield TextBlock(f"{seen.refused_by} this log: {reason.format_for_shell()}")


@dataclass(frozen=True, eq=False)
class _Seen:
    """Survey of a log, findings of its use, and the error of the commands that refuse it.

    `unnamed_step` is the time between samples if the log names no unit of time.
    """

    survey: Survey
    findings: tuple[Finding, ...] = ()
    refusal: DrivetwinError | None = None
    refused_by: str = ""
    unnamed_step: float | None = None


def _look_at(
    log: Path, card: VehicleCard | None, stated: Mapped, control: ControllerCard | None = None
) -> _Seen:
    """Survey a log and read it as for use; a log without a unit of time is surveyed in seconds.

    With the card of a gearbox control it is read as one of that control.
    """
    commanded = () if control is None else tuple(control.gains)
    try:
        with open_stated(log, stated) as (opened, used):
            recording = Remembered(opened)
            found, names, used = _survey(recording, log, card, used, commanded)
            if control is not None:
                return _Seen(found, *_read_as_control_log(log, control, used))
            findings, refusal, refused_by = _read_as_mapped_log(
                recording, log, names, used, gearing=card is not None
            )
            if card is None:
                findings = drop_card_findings(findings)
            return _Seen(found, findings, refusal, refused_by)
    except DrivetwinError as fault:
        names_unit = stated.options.time.unit is not None or not isinstance(fault, UnitError)
        if names_unit and not stated.beside:
            raise
        refusal = fault
    time = stated.options.time
    seconds = replace(stated, options=replace(stated.options, time=replace(time, unit="s")))
    bare = Mapped({}, ReadOptions(TimeColumn(unit="s")))
    with open_stated(log, seconds if time.unit is None else stated, bare) as (opened, used):
        recording = Remembered(opened)
        options = stated.options if used.file == stated.file else ReadOptions()
        found, _, _ = _survey(recording, log, card, replace(used, options=options), commanded)
        step = find_shortest_step(recording)
    return _Seen(found, used.findings, refusal, "shifts and identify refuse", step)


def _survey(
    recording: Recording,
    log: Path,
    card: VehicleCard | None,
    stated: Mapped,
    commanded: Sequence[str],
) -> tuple[Survey, VehicleCard | None, Mapped]:
    """Survey a log; return also the card and mapping with the names of the pressures.

    Without a card pressures are named after their columns.
    """
    names = card
    specs = {}
    if commanded:
        stated = name_commands(recording.columns, commanded, stated)
    elif card is None:
        specs = find_pressure_columns(recording.columns, stated, any_name=False)
    if specs:
        names, stated = name_pressures(specs, stated)
    found = survey_recording(recording, str(log), names, stated)
    if specs:
        note = (
            f"no vehicle card: pressures are named after their columns: {', '.join(specs)}; "
            "--vehicle CARD names them after its elements"
        )
        found = replace(found, notes=(*found.notes, note))
    return found, names, stated


def _write_unread(
    path: Path,
    card: VehicleCard | None,
    stated: Mapped,
    fault: DrivetwinError,
    databases: Sequence[str],
) -> None:
    """Write a mapping with what is stated and stubs of all roles, for a log that cannot be read."""
    elements = None if card is None else tuple(card.elements)
    draft = draft_unread(elements, stated.channels, fault.what, databases)
    write_text(path, format_mapping(stated.channels, stated.options, stated.names, draft))
    print_line(f"wrote {path}", stderr=True)


def _read_as_control_log(
    log: Path, card: ControllerCard, stated: Mapped
) -> tuple[tuple[Finding, ...], DrivetwinError | None, str]:
    """Cut the shifts of the log of a gearbox control; return findings, error and who refuses it."""
    try:
        left_out = read_controller_log(log, card, stated).left_out
    except DrivetwinError as fault:
        return (), fault, "identify refuses"
    return (
        tuple(report(Code.RECORDING, text=f"shift left out, {one}") for one in left_out),
        None,
        "",
    )


def _read_as_mapped_log(
    recording: Recording, log: Path, card: VehicleCard | None, stated: Mapped, *, gearing: bool
) -> tuple[tuple[Finding, ...], DrivetwinError | None, str]:
    """Read a log as for use, missing roles allowed; return findings, error and who refuses it."""
    any_role, for_shifts = Demands((), None, gearing), Demands((), FOR_SHIFTS, gearing)
    try:
        with name_project_mapping(stated):
            found = assemble_log(recording, str(log), card, stated, any_role)
        return found.findings, None, ""
    except DrivetwinError as fault:
        refusal = fault
    try:
        with name_project_mapping(stated):
            found = assemble_log(recording, str(log), card, stated, for_shifts)
    except DrivetwinError as fault:
        return (), fault, "shifts and identify refuse"
    return found.findings, refusal, "identify refuses"


_MOST_ROWS = 1000
"""Columns without a role that the table lists at most."""


def _select_shown(columns: Sequence[Column]) -> list[Column]:
    """Return the columns of the table: all with a role, and the first ones without."""
    free = (k for k, column in enumerate(columns) if not column.roles)
    last = next(islice(free, _MOST_ROWS, None), len(columns))
    return [column for k, column in enumerate(columns) if k < last or column.roles]
