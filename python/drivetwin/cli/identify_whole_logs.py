# SPDX-License-Identifier: MIT
"""`drivetwin identify` of all bus logs, or all logs of a gearbox control, of one vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.input_files import find_logs, find_mapping
from drivetwin.cli.options import (
    BUS_RESULT,
    REPORT,
    TCU_RESULT,
    TWIN,
)
from drivetwin.cli.output import refuse_same_names, show_step, write_atomically, write_texts
from drivetwin.cli.requests.identification import Identify
from drivetwin.errors import InputError, Where
from drivetwin.files.bus_file import build_tcu_file, save_tcu_twin
from drivetwin.files.twin_file import save_twin
from drivetwin.logs.read import read_log
from drivetwin.report.blocks import Outcome, Page, Tone
from drivetwin.report.bus import build_tcu_blocks, build_tcu_page, identify_vehicle
from drivetwin.report.html import save_page
from drivetwin.tcu.card import load_controller_card
from drivetwin.tcu.outcome import TcuIdentification, identify_controller
from drivetwin.twin.build_controlled import build_shift_twin
from drivetwin.vehicle.card import load_ratio_card


def identify_controller_logs(request: Identify) -> Outcome:
    """Identify the plant from all logs of one vehicle.

    Raises InputError for options of other logs, and the typed errors of reader and fit.
    """
    unused = ("bus", "quick", "effects")
    request.refuse_stated(unused, "the log of a gearbox control has one method")
    assert request.vehicle is not None, "a gearbox control has a card"
    card, held = load_controller_card(request.vehicle), _read_numbers(request.hold_out)
    with show_step(f"identifying {len(request.logs)} logs of a gearbox control"):
        found = identify_controller(request.logs, card, request.channels, held)
    file = build_tcu_file(found, request.describe_settings())
    files: Sequence[Path] = ()
    if request.output is not None:
        files = _write(found, request.output, file.to_json())
    document = file.model_dump(mode="json", by_alias=True)
    return Outcome(build_tcu_blocks(found), document, files, found.status.is_confirmed)


def _read_numbers(wanted: Sequence[str]) -> list[int] | None:
    """Return the numbers of held-out shifts, None without any. Raises InputError for others."""
    for text in wanted:
        if not text.isdecimal():
            raise InputError(
                f"{text!r} is no number of a shift",
                "give the number of a shift, counted over all logs",
                Where(key="--hold-out"),
            )
    return [int(text) for text in wanted] or None


def _write(found: TcuIdentification, folder: Path, result: str) -> tuple[Path, ...]:
    """Write result, twin and report into `folder`, all or none; return their paths."""
    kinds = found.twin.kinds if found.status.is_confirmed else ()
    twins = {f"shift_{kind}.toml": build_shift_twin(found.found, kind) for kind in kinds}
    with write_atomically(folder) as beside:
        save_tcu_twin(beside / TWIN, found.twin)
        for name, twin in twins.items():
            save_twin(beside / name, twin)
        (beside / TCU_RESULT).write_text(result, encoding="utf-8", newline="\n")
        save_page(beside / REPORT, build_tcu_page(found))
    return tuple(folder / name for name in (TCU_RESULT, TWIN, REPORT, *twins))


def identify_bus_logs(request: Identify) -> Outcome:
    """Read all logs, identify those that are not held out, predict the decays of the rest.

    Raises the typed errors of the readers, and InputError for what needs a whole vehicle card.
    """
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
        texts: dict[str, str | Page] = {BUS_RESULT: file.to_json(), REPORT: made.build_page()}
        files = write_texts(request.output, texts)
    return Outcome(made.build_blocks(), file.to_document(), files, made.verdict.tone is Tone.GOOD)


def _read(path: Path, channels: Path | None, vehicle: Path | None) -> ShiftLog:
    """Read a log without a vehicle card; one with an output torque needs a card."""
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
        found = [logs[k] for k in find_logs(text, logs)]
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
