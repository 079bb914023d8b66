# SPDX-License-Identifier: MIT
"""Arguments common to several commands, and the loading of log and card."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
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
    typer.Option("--channels", metavar="MAP", help="Channel mapping file (TOML)."),
]


def load_inputs(log: Path, vehicle: Path, channels: Path | None) -> tuple[ShiftLog, VehicleCard]:
    """Read card, mapping and log for finding shifts; raises the typed errors of their readers."""
    from drivetwin.channels.roles import FOR_SHIFTS
    from drivetwin.logs.read import read_log
    from drivetwin.vehicle.card import load_card

    card = load_card(vehicle)
    return read_log(log, card, channels, sound=FOR_SHIFTS), card
