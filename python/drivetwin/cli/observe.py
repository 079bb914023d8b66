# SPDX-License-Identifier: MIT
"""`drivetwin observe TWIN LOG`: torques that no sensor of the log shows, with bands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.request import LOG_ENDINGS, PAGE, select_outputs
from drivetwin.cli.input_files import build_log_remarks, read_twin_log
from drivetwin.cli.output import show_step, write_atomically
from drivetwin.cli.requests.use import Observe
from drivetwin.errors import DamagedChannelError
from drivetwin.export.parameters.content import to_flat_name
from drivetwin.files.twin_file import load_twin
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.write import write_log
from drivetwin.observer.linear_model import Observation
from drivetwin.observer.smooth import estimate_torques
from drivetwin.report.blocks import Outcome, Tone, make_notes
from drivetwin.report.html import save_page
from drivetwin.report.whole_drive import build_observer_page, build_torque_blocks
from drivetwin.shifts.detect import require_shifts
from drivetwin.shifts.shift import Shift, compute_exclusive_masks


def observe(request: Observe) -> Outcome:
    """Observe the shifts of a log, and write table and page."""
    model = load_twin(request.twin)
    recording, card = read_twin_log(model, request.log, request.vehicle, request.channels)
    shifts = require_shifts(recording, card)
    found, left_out = _observe_shifts(
        shifts.shifts, lambda shift: estimate_torques(model, recording, shift)
    )
    for table in select_outputs(request.output, *LOG_ENDINGS):
        _write_observations(table, found)
    for page in select_outputs(request.output, *PAGE):
        save_page(page, build_observer_page(found, recording))
    reasons = [f"Shift {name}: {reason}" for name, reason in left_out.items()]
    blocks = [block for one in found for block in build_torque_blocks(one)]
    remarks, noted = build_log_remarks(recording, card, shifts)
    listed = {"shifts": [_describe_torques(one) for one in found], "left_out": left_out}
    return Outcome(
        [*blocks, *make_notes("Left out", reasons, Tone.DOUBTFUL), *remarks],
        listed | noted,
        request.output,
    )


def _observe_shifts(
    shifts: Sequence[Shift], look: Callable[[Shift], Observation]
) -> tuple[list[Observation], dict[str, str]]:
    """Observe each shift; return the observations, and the skip reason by shift name."""
    found: list[Observation] = []
    left_out: dict[str, str] = {}
    for shift in shifts:
        name = f"{shift.start_gear}-{shift.end_gear}"
        try:
            with show_step(f"observing shift {name}"):
                found.append(look(shift))
        except DamagedChannelError as refusal:
            left_out[f"{name} at {shift.torque_phase[0]:z.3f} s"] = refusal.what
            if len(left_out) == len(shifts):
                raise
    return found, left_out


def _write_observations(path: Path, found: Sequence[Observation]) -> None:

    channels = collect_channels(found)
    if path.suffix.casefold() == ".mat":
        channels = tuple(replace(one, name=to_flat_name(one.name)) for one in channels)
    with write_atomically(path.parent) as folder:
        write_log(folder / path.name, channels)


def collect_channels(found: Sequence[Observation]) -> tuple[RawChannel, ...]:
    """Each torque with its standard deviation, N·m, one shift after the other.

    A gear that is held between two shifts is divided in its middle: time increases throughout.
    """
    own = compute_exclusive_masks([one.shift for one in found], [one.time for one in found])
    parts: dict[str, list[tuple[Any, Any]]] = {}
    for one, kept in zip(found, own, strict=True):
        for name, band in one.bands.items():
            parts.setdefault(name, []).append((one.time[kept], band.value[kept]))
            parts.setdefault(f"{name}_std", []).append((one.time[kept], band.std[kept]))
    return tuple(
        RawChannel(
            name,
            "Nm",
            np.concatenate([time for time, _ in pieces]),
            np.concatenate([values for _, values in pieces]),
        )
        for name, pieces in parts.items()
    )


def _describe_torques(one: Observation) -> dict[str, Any]:
    return {
        "from": one.shift.start_gear,
        "to": one.shift.end_gear,
        "time": [float(one.time[0]), float(one.time[-1])],
        "torques": {
            name: {
                "lowest": float(band.value.min()),
                "highest": float(band.value.max()),
                "std_mean": float(band.std.mean()),
                "std_largest": float(band.std.max()),
            }
            for name, band in one.bands.items()
        },
        "notes": list(one.notes),
    }
