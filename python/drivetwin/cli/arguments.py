# SPDX-License-Identifier: MIT
"""Arguments common to several commands, and the loading of log and card."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard

LogFile = Annotated[
    Path, typer.Argument(metavar="LOG", help="Shift log: CSV, MDF, MAT, Parquet, bus log.")
]
VehicleFile = Annotated[
    Path, typer.Option("--vehicle", metavar="CARD", help="Vehicle card (TOML).")
]
OptionalVehicleFile = Annotated[
    Path | None,
    typer.Option("--vehicle", metavar="CARD", help="Vehicle card, in place of the twin's own."),
]
ChannelsFile = Annotated[
    Path | None,
    typer.Option(
        "--channels",
        metavar="MAP",
        help="Channel mapping file (TOML); without it channels.toml beside the log and the mapping "
        "of the twin, if any.",
    ),
]


PROJECT_MAPPING = "channels.toml"
"""Channel mapping of a project folder, for the logs beside it."""


def find_mapping(channels: Path | None, log: Path) -> Path | None:
    """Return the mapping file that was given, else `channels.toml` beside the log, else None."""
    if channels is not None:
        return channels
    beside = log.parent / PROJECT_MAPPING
    return beside if beside.is_file() else None


def _load_twin_card(twin: Twin, vehicle: Path | None) -> VehicleCard:
    """Return the card in the file `vehicle`, without one the twin's own.

    Both remember the channel mapping of the twin.
    """
    from drivetwin.vehicle.card import load_card

    if vehicle is None:
        return twin.build_card()
    return replace(load_card(vehicle), remembered=twin.mapping)


def read_twin_log(
    twin: Twin, log: Path, vehicle: Path | None, channels: Path | None
) -> tuple[ShiftLog, VehicleCard]:
    """Read a log for use with a twin, and the card in the file `vehicle` or the twin's own.

    Units and options that come from the twin are shown. Raises the typed errors of the readers.
    """
    from drivetwin.channels.recall import RECALLED
    from drivetwin.cli.output import show_findings, show_step
    from drivetwin.logs.read import read_log

    card = _load_twin_card(twin, vehicle)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, card, find_mapping(channels, log))
    show_findings(one for one in recording.findings if one.code in RECALLED)
    return recording, card


def load_inputs(log: Path, vehicle: Path, channels: Path | None) -> tuple[ShiftLog, VehicleCard]:
    """Read card, mapping and log for finding shifts; raises the typed errors of their readers."""
    from drivetwin.channels.roles import FOR_SHIFTS
    from drivetwin.logs.read import read_log
    from drivetwin.vehicle.card import load_card

    card = load_card(vehicle)
    return read_log(log, card, find_mapping(channels, log), sound=FOR_SHIFTS), card
