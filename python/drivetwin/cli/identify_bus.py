# SPDX-License-Identifier: MIT
"""`drivetwin identify` on bus logs: speeds, gear and engine torque, all logs of one vehicle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.arguments import REPORT, find_mapping
from drivetwin.cli.atomic_outputs import refuse_same_names
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.report.bus_outcome import BusOutcome

BUS_RESULT = "bus.json"
"""Result that `identify -o` writes for bus logs."""


def identify_bus_logs(
    logs: Sequence[Path],
    vehicle: Path | None,
    channels: Path | None,
    hold_out: Sequence[str],
    strict: bool,
) -> BusOutcome:
    """Read all logs, identify those that are not held out, predict the decays of the rest.

    Raises the typed errors of the readers, and InputError for what needs a whole vehicle card.
    """
    from drivetwin.report.bus_outcome import identify_vehicle
    from drivetwin.vehicle.ratio_card import load_ratio_card

    if strict:
        raise InputError(
            "bus logs give quantities with verdicts, but no model to validate",
            "leave out --strict",
            Where(key="--strict"),
        )
    refuse_same_names(logs, "rename one of them")
    held = _find_held(hold_out, logs)
    card = None if vehicle is None else load_ratio_card(vehicle)
    with show_step(f"reading {len(logs)} logs"):
        read = [_read(path, channels, vehicle) for path in logs]
    with show_step("identifying"):
        return identify_vehicle(read, card, [logs.index(path) for path in held])


def _read(path: Path, channels: Path | None, vehicle: Path | None) -> ShiftLog:
    """Read a log without a vehicle card; one with an output torque needs a card."""
    from drivetwin.logs.read import read_log

    log = read_log(path, None, find_mapping(channels, path))
    if "output_torque" in log and vehicle is None:
        raise InputError(
            "the log has an output torque, and no vehicle card is given",
            "give --vehicle CARD; 'drivetwin card new --from LOG' writes one. With --bus and a "
            "card of the ratios the torque is not used",
            Where(file=str(path), key="--vehicle"),
        )
    return log


def _find_held(wanted: Sequence[str], logs: Sequence[Path]) -> list[Path]:
    """Logs to predict; raises InputError for a name of none, and where no log is left."""
    held = []
    for text in wanted:
        found = [one for one in logs if text in (str(one), one.name, one.stem)]
        if len(found) != 1:
            raise InputError(
                f"{text!r} names no log of {', '.join(one.name for one in logs)}",
                "give one of the logs: of bus logs, a whole log is held out",
                Where(key="--hold-out"),
            )
        held += found
    if held and len(set(held)) == len(logs):
        raise InputError(
            "all logs are held out", "leave at least one to identify", Where(key="--hold-out")
        )
    return list(dict.fromkeys(held))


def write_bus(outcome: BusOutcome, folder: Path, settings: Mapping[str, str]) -> tuple[Path, ...]:
    """Write result and report into `folder`, all or none; returns their paths."""
    from drivetwin.cli.atomic_outputs import write_texts

    texts = {BUS_RESULT: outcome.build_file(settings).to_json(), REPORT: outcome.render()}
    return write_texts(folder, texts)
