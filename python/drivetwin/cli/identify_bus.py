# SPDX-License-Identifier: MIT
"""`drivetwin identify` on bus logs: speeds, gear and engine torque, all logs of one vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.arguments import BUS_RESULT, REPORT, find_mapping
from drivetwin.cli.atomic_outputs import refuse_same_names, write_texts
from drivetwin.cli.output import show_step
from drivetwin.errors import InputError, Where
from drivetwin.report.outcome import Outcome

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.cli.identify import Identify


def identify_bus_logs(request: Identify) -> Outcome:
    """Read all logs, identify those that are not held out, predict the decays of the rest.

    Raises the typed errors of the readers, and InputError for what needs a whole vehicle card.
    """
    from drivetwin.report.bus_outcome import identify_vehicle
    from drivetwin.vehicle.ratio_card import load_ratio_card

    logs, vehicle = request.logs, request.vehicle
    refuse_same_names(logs, "rename one of them")
    held = _find_held(request.hold_out, logs)
    card = None if vehicle is None else load_ratio_card(vehicle)
    with show_step(f"reading {len(logs)} logs"):
        read = [_read(path, request.channels, vehicle) for path in logs]
    with show_step("identifying"):
        made = identify_vehicle(read, card, [logs.index(path) for path in held])
    file = made.build_file(request.describe_settings())
    files: Sequence[Path] = ()
    if request.output is not None:
        texts = {BUS_RESULT: file.to_json(), REPORT: made.render()}
        files = write_texts(request.output, texts)
    return Outcome(made.build_blocks(), file.to_document(), files, made.verdict.is_confirmed)


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
