# SPDX-License-Identifier: MIT
"""Time vectors of a MATLAB workspace by name and content, for rasters of their own."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.channels.names import is_time_name
from drivetwin.channels.shiftlog import FloatArray

_WORD = r"(?:time|times|timestamps?|zeit|messzeit|tout)"
_RASTER = re.compile(
    rf"{_WORD}_?(?P<after>\w+)|(?P<before>\w+)_{_WORD}"
    r"|t_?(?P<step>\d+(?:p\d+)?_?(?:ns|us|ms|s|hz|khz))",
    re.IGNORECASE | re.ASCII,
)
"""Name of the time vector of a raster: `time_10ms`, `Zeit_CAN`, `fast_time`, `t_1ms`."""

_INCREASING = 0.99
"""Least share of steps that increase; a logger may repeat single stamps."""

_ASAMMDF = re.compile(r"DG(\d+)_(.+)", re.ASCII)
"""Name of a channel that asammdf exports; the time of its group is `DGM<number>_timestamps`."""


def is_raster_time(name: str, values: FloatArray) -> bool:
    """Return True if a vector has the name of the time of a raster and increases."""
    if _RASTER.fullmatch(name) is None:
        return False
    steps = np.diff(values)
    return bool(np.all(steps >= 0.0)) and float(np.mean(steps > 0.0)) >= _INCREASING


def split_asammdf_name(name: str, vectors: Mapping[str, FloatArray]) -> tuple[str, str, str] | None:
    """Return channel name, group and time vector of a name by asammdf; None for other names."""
    match = _ASAMMDF.fullmatch(name)
    if match is None:
        return None
    time = f"DGM{match[1]}_timestamps"
    return (match[2], f"DG{match[1]}", time) if time in vectors else None


def choose_time(
    name: str, size: int, times: Sequence[str], vectors: Mapping[str, FloatArray]
) -> list[str]:
    """Return the time vectors among `times` that a vector of `size` samples may belong to.

    Of several of its length, those count that share a raster with the name (`n_10ms` beside
    `time_10ms`), then those of a plain name (`t`, `time`). Of equal vectors only the first counts.
    """
    fitting = [time for time in times if vectors[time].size == size]
    sharing = [time for time in fitting if _shares_raster(name, time)]
    plain = [time for time in fitting if is_time_name(time)]
    chosen = sharing or plain or fitting
    different: list[str] = []
    for time in chosen:
        if not any(np.array_equal(vectors[time], vectors[other]) for other in different):
            different.append(time)
    return different


def _shares_raster(name: str, time: str) -> bool:
    match = _RASTER.fullmatch(time)
    raster = next(filter(None, match.groups()), "").casefold() if match else ""
    text = name.casefold()
    return bool(raster) and (text.endswith(f"_{raster}") or text.startswith(f"{raster}_"))
