# SPDX-License-Identifier: MIT
"""Pages of single logs that share one plotly.js, and the samples behind them."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np

from drivetwin._util.atomic import write_bytes, write_text
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.report.bus import BusOutcome
from drivetwin.report.html import render_report, save_library

LIBRARY = "plotly.js"


def save_single(path: Path, found: Identification, log: ShiftLog) -> None:
    """Write the report of one log; all reports of a fleet use one library file."""
    _save_page(path, render_report(found, log, LIBRARY))


def save_vehicle(path: Path, outcome: BusOutcome) -> None:
    """Write the report of the bus logs of one vehicle."""
    _save_page(path, outcome.render(LIBRARY))


def _save_page(path: Path, text: str) -> None:
    library = path.with_name(LIBRARY)
    if not library.is_file():
        save_library(library)
    write_text(path, text)


def save_traces(path: Path, found: Identification) -> None:
    """Write simulation over measurement as a Parquet table: shift, signal, time [s], values SI."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, list[object]] = {"shift": [], "signal": []}
    numbers: dict[str, list[np.ndarray[tuple[int], np.dtype[np.float64]]]] = {
        "time": [], "measured": [], "simulated": [],
    }  # fmt: skip
    for number, validation in enumerate(found.evidence.validation):
        for signal, trace in validation.traces.items():
            columns["shift"] += [number] * trace.time.size
            columns["signal"] += [signal] * trace.time.size
            for name, parts in numbers.items():
                parts.append(getattr(trace, name))
    values = {name: np.concatenate([np.empty(0), *parts]) for name, parts in numbers.items()}
    buffer = BytesIO()
    pq.write_table(pa.table({**columns, **values}), buffer, compression="zstd")
    write_bytes(path, buffer.getvalue())
