# SPDX-License-Identifier: MIT
"""`drivetwin inspect LOG`: what a file holds and what each column would be taken for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.arguments import ChannelsFile, LogFile, find_mapping
from drivetwin.cli.output import (
    JsonFlag,
    make_table,
    print_findings,
    print_json,
    print_line,
    print_paragraph,
    print_table,
    show_step,
    to_error_document,
)
from drivetwin.errors import DrivetwinError
from drivetwin.findings import Finding

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.channels.mapping import Mapped
    from drivetwin.logs.raw import Recording
    from drivetwin.vehicle.card import VehicleCard


def inspect(
    log: LogFile,
    vehicle: Annotated[
        Path | None,
        typer.Option(
            "--vehicle", metavar="CARD", help="Vehicle card; its elements name the pressures."
        ),
    ] = None,
    channels: ChannelsFile = None,
    write_mapping: Annotated[
        Path | None,
        typer.Option(metavar="MAP", help="Write the mapping shown as a file to edit."),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """List the columns of a log: unit, rate, range, gaps, and the role each would play.

    And what `shifts` and `identify` would warn of in it, or refuse it for.
    """
    from drivetwin._util.atomic import write_text
    from drivetwin.channels.mapping import Mapped
    from drivetwin.channels.mapping_file import format_mapping, read_mapping
    from drivetwin.files.records import dump_findings
    from drivetwin.logs.formats.detect import open_recording
    from drivetwin.logs.raw import Remembered
    from drivetwin.logs.survey import survey_recording
    from drivetwin.vehicle.card import load_card

    card = None if vehicle is None else load_card(vehicle)
    mapping = find_mapping(channels, log)
    stated = Mapped({}) if mapping is None else read_mapping(mapping)
    with show_step(f"reading {log.name}"), open_recording(log, stated.options) as opened:
        recording = Remembered(opened)
        found = survey_recording(recording, str(log), card, stated)
        findings, refusal, commands = _read_as_mapped_log(recording, log, card, stated)
    if write_mapping is not None:
        write_text(write_mapping, format_mapping(found.mapping, found.options, found.unitless))
    if as_json:
        error = None if refusal is None else to_error_document(refusal)["error"]
        remarks = {"findings": dump_findings(findings), "refusal": error}
        print_json(found.to_document() | remarks)
        return
    print_table(_build_table([column.to_document() for column in found.columns], log.name))
    for text in found.notes:
        print_paragraph(text)
    if found.unitless:
        print_paragraph(
            f"no unit for {', '.join(sorted(found.unitless))}: state it in a channel mapping"
        )
    print_findings(one for one in findings if one.names.get("text") not in found.notes)
    if refusal is not None:
        print_paragraph(f"{commands} this log: {refusal}")
    if write_mapping is not None:
        print_line(f"wrote {write_mapping}")


def _read_as_mapped_log(
    recording: Recording, log: Path, card: VehicleCard | None, stated: Mapped
) -> tuple[tuple[Finding, ...], DrivetwinError | None, str]:
    """Read a log as for use, missing roles allowed; return findings, error and who refuses it."""
    from drivetwin.channels.roles import FOR_SHIFTS
    from drivetwin.logs.read import Demands, read_recording

    try:
        return read_recording(recording, log, card, stated, Demands(())).findings, None, ""
    except DrivetwinError as fault:
        refusal = fault
    try:
        found = read_recording(recording, log, card, stated, Demands((), FOR_SHIFTS))
    except DrivetwinError as fault:
        return (), fault, "shifts and identify refuse"
    return found.findings, refusal, "identify refuses"


def _build_table(columns: list[dict[str, Any]], source: str) -> Table:
    table = make_table(
        f"Columns of {source}", "column", "group", "unit", "Hz", "min", "max", "gaps", "role",
        right=("Hz", "min", "max", "gaps"),
    )  # fmt: skip
    for column in columns:
        low, high = column["range"] or (None, None)
        table.add_row(
            column["name"],
            column["group"],
            column["unit"] or "none",
            _format_cell(column["rate"]),
            _format_cell(low),
            _format_cell(high),
            str(column["gaps"]),
            ", ".join(column["roles"]) or "-",
        )
    return table


def _format_cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
