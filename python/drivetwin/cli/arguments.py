# SPDX-License-Identifier: MIT
"""Arguments common to several commands, and the loading of log and card."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.errors import ResultFileError, Where

if TYPE_CHECKING:
    from drivetwin.channels.mapping import Mapped
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard

RESULT, TWIN, REPORT = "result.json", "twin.toml", "report.html"
"""Files that `identify -o` writes."""


def find_twin(source: Path) -> Path:
    """Return the twin file of a source: the file itself, or that of an output folder or result.

    Raises ResultFileError if the source is another kind of file, or has no twin.
    """
    from drivetwin.cli.file_kinds import FileKind, recognise_file, require_kind

    if source.is_dir():
        path = source / TWIN
    elif recognise_file(source) is FileKind.RESULT:
        path = source.with_name(TWIN)
    else:
        require_kind(source, FileKind.TWIN)
        return source
    if not path.is_file():
        raise ResultFileError(
            f"there is no {TWIN} in {path.parent}",
            "give the folder that 'drivetwin identify LOG --vehicle CARD -o DIR' wrote, or its "
            f"{TWIN}",
            Where(file=str(source)),
        )
    return path


def require_log(source: Path) -> Path:
    """Return the path of a log; raises FileFormatError if it is a twin, a card or another file."""
    from drivetwin.cli.file_kinds import FileKind, require_kind

    require_kind(source, FileKind.LOG)
    return source


def require_logs(sources: list[Path]) -> list[Path]:
    """Return paths of logs; raises FileFormatError as `require_log` does."""
    return [require_log(source) for source in sources]


def require_card(source: Path | None) -> Path | None:
    """Return the path of a card; raises CardError if it is a log, a twin or another file."""
    from drivetwin.cli.file_kinds import FileKind, require_kind

    if source is not None:
        require_kind(source, FileKind.CARD)
    return source


TwinFile = Annotated[
    Path,
    typer.Argument(
        metavar="TWIN",
        help="Identified model: twin.toml, or the folder of 'identify -o'.",
        callback=find_twin,
    ),
]
LogFile = Annotated[
    Path,
    typer.Argument(
        metavar="LOG", help="Shift log: CSV, MDF, MAT, Parquet, bus log.", callback=require_log
    ),
]
VehicleFile = Annotated[
    Path,
    typer.Option(
        "--vehicle",
        metavar="CARD",
        help="Vehicle card (TOML), as 'drivetwin card new' writes it.",
        callback=require_card,
    ),
]
OptionalCardFile = Annotated[
    Path | None,
    typer.Option(
        "--vehicle",
        metavar="CARD",
        help="Vehicle card (TOML), as 'drivetwin card new' writes it.",
        callback=require_card,
    ),
]
ModelFile = Annotated[
    Path | None,
    typer.Option(
        "--model", metavar="MODEL", help="Model file of 'drivetwin fit', in place of a card."
    ),
]
OptionalVehicleFile = Annotated[
    Path | None,
    typer.Option(
        "--vehicle",
        metavar="CARD",
        help="Vehicle card, in place of that of the twin.",
        callback=require_card,
    ),
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


def find_mapping(channels: Path | None, log: Path) -> Mapped:
    """Read the mapping file that was given, else `channels.toml` beside the log, if any."""
    from drivetwin.channels.mapping_file import read_mapping, read_project_mapping

    return read_project_mapping(log) if channels is None else read_mapping(channels)


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
