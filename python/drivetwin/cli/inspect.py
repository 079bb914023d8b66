# SPDX-License-Identifier: MIT
"""`drivetwin inspect LOG`: what a file holds and what each column would be taken for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.arguments import ChannelsFile, LogFile
from drivetwin.cli.output import (
    JsonFlag,
    error_document,
    note,
    print_json,
    say,
    show,
    step,
    table_of,
)
from drivetwin.errors import DrivetwinError

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
    from drivetwin.channels.mapping_file import mapping_text, read_mapping
    from drivetwin.logs.formats.detect import open_recording
    from drivetwin.logs.survey import survey
    from drivetwin.vehicle.card import load_card

    card = None if vehicle is None else load_card(vehicle)
    stated = Mapped({}) if channels is None else read_mapping(channels)
    with step(f"reading {log.name}"), open_recording(log, stated.options) as recording:
        found = survey(recording, str(log), card, stated)
        warnings, refusal = _as_read(recording, log, card, stated)
    if write_mapping is not None:
        write_text(write_mapping, mapping_text(found.mapping, found.options, found.unitless))
    if as_json:
        error = None if refusal is None else error_document(refusal)["error"]
        print_json({**found.document(), "warnings": warnings, "refusal": error})
        return
    show(_table([column.document() for column in found.columns], log.name))
    for text in found.notes:
        note(text)
    if found.unitless:
        note(f"no unit for {', '.join(sorted(found.unitless))}: state it in a channel mapping")
    for text in warnings:
        if text not in found.notes:
            note(f"warning: {text}")
    if refusal is not None:
        note(f"shifts and identify refuse this log: {refusal}")
    if write_mapping is not None:
        say(f"wrote {write_mapping}")


def _as_read(
    recording: Recording, log: Path, card: VehicleCard | None, stated: Mapped
) -> tuple[tuple[str, ...], DrivetwinError | None]:
    """Read a log as for use, missing roles allowed; return the warnings or the error."""
    from drivetwin.logs.read import read_recording

    try:
        return read_recording(recording, log, card, stated, needed=()).warnings, None
    except DrivetwinError as fault:
        return (), fault


def _table(columns: list[dict[str, Any]], source: str) -> Table:
    table = table_of(
        f"Columns of {source}", "column", "group", "unit", "Hz", "min", "max", "gaps", "role",
        right=("Hz", "min", "max", "gaps"),
    )  # fmt: skip
    for column in columns:
        low, high = column["range"] or (None, None)
        table.add_row(
            column["name"],
            column["group"],
            column["unit"] or "none",
            _cell(column["rate"]),
            _cell(low),
            _cell(high),
            str(column["gaps"]),
            ", ".join(column["roles"]) or "-",
        )
    return table


def _cell(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"
