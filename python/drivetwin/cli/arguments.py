# SPDX-License-Identifier: MIT
"""Files that several commands read: their declarations, and the loading of log, twin and card."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.request import REQUIRED, FileRole, Request, argument, flag, input_file, option
from drivetwin.estimation.result.method import DEFAULT_METHOD

if TYPE_CHECKING:
    from drivetwin.channels.mapping import Mapped
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard

RESULT, TWIN, REPORT = "result.json", "twin.toml", "report.html"
"""Files that `identify -o` writes."""
BUS_RESULT, TCU_RESULT = "bus.json", "tcu.json"
"""Results that `identify -o` writes for bus logs, and for logs of a gearbox control."""
FIT_RESULT, MODEL = "fit.json", "model.toml"
"""Files that `fit -o` writes beside the report."""
GEARBOX_HELP = "Gearbox card (TOML), or name of a built-in gearbox."


def log_argument(help: str = "Shift log: CSV, MDF, MAT, Parquet, bus log.") -> Any:
    """Declare a log."""
    return argument(help, "LOG", role=FileRole.LOG)


def logs_argument(help: str) -> Any:
    """Declare one or more logs."""
    return argument(help, "LOG...", role=FileRole.LOG)


def card_option(default: Any = None) -> Any:
    """Declare the card of a vehicle."""
    help = "Vehicle card (TOML), as 'drivetwin card new' writes it."
    return input_file(help, "CARD", FileRole.CARD, default)


def mapping_option(**described: Any) -> Any:
    """Declare the channel mapping of a log."""
    help = (
        "Channel mapping file (TOML); without it channels.toml beside the log and the mapping of "
        "the twin, if any."
    )
    return input_file(help, "MAP", FileRole.MAPPING, **described)


def method_option() -> Any:
    """Declare the method of an identification."""
    return option("likelihood or paper.", metavar="METHOD", default=DEFAULT_METHOD)


def quick_option() -> Any:
    """Declare the identification by one model."""
    return flag("Fit one model, and try no other sampling modes, minima and elements.")


def strict_flag(condition: str) -> Any:
    """Declare `--strict`."""
    return flag(f"Exit with code 3 unless {condition}.", decides=False)


def result_argument() -> Any:
    """Declare the result of identify, examine or fit."""
    help = "Result: folder of identify, examine or fit, its result file, or twin.toml."
    return argument(help, "RESULT", role=FileRole.RESULT)


class TwinInput(Request):
    """A twin."""

    twin: Path = argument(
        "Identified model: twin.toml, or the folder of 'identify -o'.", "TWIN", role=FileRole.TWIN
    )


class CardInput(Request):
    """The card of a vehicle, and the channel mapping of its logs."""

    vehicle: Path = card_option(REQUIRED)
    channels: Path | None = mapping_option()


class LogInput(CardInput):
    """A log with card and channel mapping."""

    log: Path = log_argument()


class TwinLogInput(TwinInput):
    """A twin, and a log for use with it."""

    log: Path = log_argument()
    vehicle: Path | None = input_file(
        "Vehicle card, in place of that of the twin.", "CARD", FileRole.CARD
    )
    channels: Path | None = mapping_option()


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
    twin: Twin, log: Path, vehicle: Path | None = None, channels: Path | None = None
) -> tuple[ShiftLog, VehicleCard]:
    """Read a log for use with a twin, and the card in the file `vehicle` or the twin's own.

    Units and options that come from the twin are shown. Raises the typed errors of the readers.
    """
    from drivetwin.channels.mapping import RECALLED
    from drivetwin.cli.output import show_findings, show_step
    from drivetwin.logs.read import read_log

    card = _load_twin_card(twin, vehicle)
    with show_step(f"reading {log.name}"):
        recording = read_log(log, card, find_mapping(channels, log))
    show_findings(one for one in recording.findings if one.code in RECALLED)
    return recording, card
