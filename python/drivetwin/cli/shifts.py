# SPDX-License-Identifier: MIT
"""`drivetwin shifts LOG`: the shifts of a log and their phases."""

from __future__ import annotations

from drivetwin.cli.arguments import ChannelsFile, LogFile, VehicleFile, load
from drivetwin.cli.output import JsonFlag, note, print_json, show, step


def shifts(
    log: LogFile, vehicle: VehicleFile, channels: ChannelsFile = None, as_json: JsonFlag = False
) -> None:
    """Find the shifts of a log and their phases."""
    from drivetwin.cli.tables import shift_table
    from drivetwin.results.result_file import RejectedRecord, ShiftRecord
    from drivetwin.shifts.find import find_shifts

    with step(f"reading {log.name}"):
        recording, card = load(log, vehicle, channels)
        found = find_shifts(recording, card)
    if as_json:
        print_json(
            {
                "shifts": [ShiftRecord.of(one).model_dump(by_alias=True) for one in found.shifts],
                "rejected": [RejectedRecord.of(one).model_dump() for one in found.rejected],
                "warnings": recording.warnings,
            }
        )
        return
    show(shift_table(found.shifts, log.name))
    for candidate in found.rejected:
        start, end = candidate.time
        note(f"rejected, {start:.3f} s to {end:.3f} s: {candidate.reason}")
    for warning in recording.warnings:
        note(f"warning: {warning}")
