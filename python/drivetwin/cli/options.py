# SPDX-License-Identifier: MIT
"""Arguments that several commands have, and names of the files that they write."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from drivetwin._util.request import REQUIRED, FileRole, Request, argument, flag, input_file, option
from drivetwin.estimation.result.method import DEFAULT_METHOD

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


def effects_option() -> Any:
    """Declare the priors of effects."""
    return option(
        "Prior of an effect that the model omits, such as tyre_slip=0.002; 0: no effect.",
        "--effect",
        metavar="NAME=STD",
        default=(),
    )


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
