# SPDX-License-Identifier: MIT
"""`drivetwin inspect LOG`: what a file holds and what each column would be taken for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.arguments import ChannelsFile, LogFile
from drivetwin.cli.output import JsonFlag, note, print_json, say, show, table_of

if TYPE_CHECKING:
    from rich.table import Table


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
    """List the columns of a log: unit, rate, range, gaps, and the role each would play."""
    from drivetwin.logs.mapping import Mapped
    from drivetwin.logs.profile import mapping_text, read_mapping
    from drivetwin.logs.survey import survey
    from drivetwin.results.atomic import write_text
    from drivetwin.vehicle.card import load_card

    card = None if vehicle is None else load_card(vehicle)
    stated = Mapped({}) if channels is None else read_mapping(channels)
    found = survey(log, card, stated)
    if write_mapping is not None:
        write_text(write_mapping, mapping_text(found.mapping, found.options, found.unitless))
    if as_json:
        print_json(found.document())
        return
    show(_table([column.document() for column in found.columns], log.name))
    for text in found.notes:
        note(text)
    if found.unitless:
        note(f"no unit for {', '.join(sorted(found.unitless))}: state it in a channel mapping")
    if write_mapping is not None:
        say(f"wrote {write_mapping}")


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
