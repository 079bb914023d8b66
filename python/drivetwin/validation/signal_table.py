# SPDX-License-Identifier: MIT
"""Measured and simulated signals of shifts side by side, as a CSV table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.channels.roles import get_quantity
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.result.validation import Validation
from drivetwin.shifts.shift import compute_exclusive_masks
from drivetwin.validation.simulate_log import SIGNALS, compute_run_signals


def format_signals(runs: Sequence[Validation], log: ShiftLog) -> str:
    """CSV with a unit row: time, and each signal as measured and as simulated, SI.

    The rows are the times of the simulation. Measured values are interpolated between samples and
    empty where the log has none; a signal without a channel has no measured column. The shifts
    follow each other, and a gear that is held between two shifts is divided in its middle: time
    increases throughout.
    """
    measured = dict.fromkeys(name for run in runs for name in run.all_traces)
    names = list(dict.fromkeys((*SIGNALS, *measured)))
    columns = [
        (name, part)
        for name in names
        for part in ("measured", "simulated")
        if part == "simulated" or name in measured
    ]
    lines = [
        ",".join(["time", *(f"{name}_{part}" for name, part in columns)]),
        ",".join(["s", *(get_quantity(name).unit for name, _ in columns)]),
    ]
    own = compute_exclusive_masks(
        [run.shift for run in runs], [run.trajectory.time for run in runs]
    )
    for run, kept in zip(runs, own, strict=True):
        time, simulated = run.trajectory.time, compute_run_signals(run.model, run.trajectory)
        values = (
            simulated[name] if part == "simulated" else log[name].interpolate(time)
            for name, part in columns
        )
        rows = np.column_stack((time, *values))[kept].tolist()
        lines += [",".join(map(_format_value, row)) for row in rows]
    return "\n".join(lines) + "\n"


def _format_value(value: float) -> str:
    """Format a value; empty for none."""
    return f"{value:.12g}" if value == value else ""
