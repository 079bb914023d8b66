# SPDX-License-Identifier: MIT
"""Logs from data in memory: tables of arrays, data frames, and signals with their own stamps."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.mapping import Mapped
from drivetwin.channels.names import find_time_indices, rank_clocks
from drivetwin.channels.roles import FOR_SHIFTS, ChannelSpec, TimeColumn
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.raw import RawChannel, RawLog, describe_origin, find_origin, subtract_origin
from drivetwin.logs.read import Demands, assemble_log
from drivetwin.vehicle.card import VehicleCard


class Signal(Protocol):
    """Signal with stamps of its own, as those of asammdf: `timestamps` (n,) [s], `samples` (n,)."""

    name: str
    unit: str
    timestamps: ArrayLike
    samples: ArrayLike


class Frame(Protocol):
    """Data frame, as that of pandas or polars."""

    @property
    def columns(self) -> Iterable[str]: ...

    def __getitem__(self, column: str, /) -> ArrayLike: ...


@check_arguments
def read_arrays(
    data: Mapping[str, ArrayLike] | Frame | Iterable[Signal],
    card: VehicleCard | None,
    units: Mapping[str, str] | None = None,
    mapping: Mapping[str, str | ChannelSpec] | None = None,
    needed: Iterable[str] = FOR_SHIFTS,
    name: str = "arrays",
) -> ShiftLog:
    """Make a shift log of data in memory, with the checks of `read_log`.

    Parameters
    ----------
    data : mapping, DataFrame, or iterable of signals
        Columns by name, one of them a time [s] by its name, as `time` or `Zeit`; or a data frame,
        whose index counts as time where no column is one; or signals with `name`, `unit`,
        `timestamps` [s] and `samples`, as `asammdf.MDF.iter_channels` gives them. A time of a table
        may be numbers [s], time spans or dates.
    card : VehicleCard or None
        Vehicle card; without one no column is a pressure.
    units : mapping of str to str, optional
        Unit of a column by its name, over that of the data.
    mapping : mapping of str to str or ChannelSpec, optional
        Column, or column with sign, scale, offset and time shift, by channel role; other roles are
        found by name.
    needed : iterable of str
        Roles that must exist.
    name : str
        Name of the log in results and errors.

    Returns
    -------
    ShiftLog
        Channels by role in SI; its digest is that of the numbers.

    Raises
    ------
    FileFormatError
        If there is no time, or a column is no row of numbers as long as the time.
    DrivetwinError
        As `read_log`.
    """
    channels, remarks = _count_from_start(*_list_channels(data, dict(units or {}), name))
    specs = {
        role: one if isinstance(one, ChannelSpec) else ChannelSpec(one)
        for role, one in (mapping or {}).items()
    }
    recording = RawLog(channels, warnings=remarks, source=name)
    log = assemble_log(recording, name, card, Mapped(specs), Demands(needed))
    return replace(log, sha256=_compute_digest(channels))


def _list_channels(
    data: Any, units: Mapping[str, str], name: str
) -> tuple[list[RawChannel], tuple[str, ...]]:
    """Return the columns of a table, or the signals, and remarks on the time."""
    if not isinstance(data, Mapping) and not hasattr(data, "columns"):
        return [_convert_signal(one, units, name) for one in _iterate_signals(data, name)], ()
    columns = list(data.columns if hasattr(data, "columns") else data)
    named = [str(column) for column in columns]
    found = find_time_indices(named, [None] * len(named), TimeColumn())
    times = [columns[index] for index in rank_clocks(named, found)]
    if not times and not hasattr(data, "index"):
        raise FileFormatError(
            f"none of the {len(columns)} columns is a time by its name",
            "name the column of the time stamps [s] 'time'",
            Where(file=name),
        )
    stamps, label = (data[times[0]], str(times[0])) if times else (data.index, "index")
    stamps, remarks = _count_dates(stamps)
    time = _convert_to_numbers(stamps, label, name)
    if times[1:]:
        left = ", ".join(map(str, times[1:]))
        remarks = (f"several time columns: {times[0]} is used, not {left}", *remarks)
    taken = [column for column in columns if column not in times]
    channels = [_make_channel(str(one), units.get(one), time, data[one], name) for one in taken]
    return channels, remarks


def _iterate_signals(data: Any, name: str) -> Iterator[Signal]:
    """Yield the signals. Raises FileFormatError for what is neither signal nor table."""
    signals = data if isinstance(data, Iterable) and not isinstance(data, str | bytes) else [data]
    for one in signals:
        if not all(hasattr(one, part) for part in ("name", "unit", "timestamps", "samples")):
            raise FileFormatError(
                f"a {type(data).__name__} is neither a table nor a list of signals",
                "give columns by name, with the time among them, a data frame, or signals with "
                "name, unit, timestamps and samples; a file is read by drivetwin.read_log",
                Where(file=name),
            )
        yield one


def _convert_signal(one: Signal, units: Mapping[str, str], name: str) -> RawChannel:
    time = _convert_to_numbers(one.timestamps, one.name, name)
    return _make_channel(one.name, units.get(one.name, one.unit), time, one.samples, name)


def _count_dates(stamps: Any) -> tuple[Any, tuple[str, ...]]:
    """Return dates as time spans from the first, with a remark; other stamps as they are.

    Dates with a time zone count in UTC, so a change of the clock is no jump.
    """
    if getattr(getattr(stamps, "dtype", None), "tz", None) is not None:
        stamps = stamps.to_numpy(dtype="datetime64[ns]")
    array = np.asarray(stamps)
    if not np.issubdtype(array.dtype, np.datetime64) or not array.size:
        return stamps, ()
    known = array[~np.isnat(array)]
    if not known.size:
        return stamps, ()
    return array - known[0], (f"time counts from the first stamp, {known[0]}",)


def _count_from_start(
    channels: Sequence[RawChannel], remarks: tuple[str, ...]
) -> tuple[tuple[RawChannel, ...], tuple[str, ...]]:
    """Count the time of all channels from one first stamp if they start far from zero."""
    origin = find_origin(one.time[0] for one in channels if one.time.size)
    shifted = (replace(one, time=subtract_origin(one.time, origin)) for one in channels)
    return tuple(shifted), (*remarks, *describe_origin(origin))


def _make_channel(
    column: str, unit: str | None, time: FloatArray, samples: ArrayLike, name: str
) -> RawChannel:
    values = _convert_to_numbers(samples, column, name)
    if values.size != time.size:
        raise FileFormatError(
            f"{values.size} values for {time.size} time stamps",
            "give one value for each time stamp",
            Where(file=name, channel=column),
        )
    return RawChannel(column, unit or None, time, values)


def _convert_to_numbers(values: ArrayLike, column: str, name: str) -> FloatArray:
    """Convert a row of values to numbers; time spans of NumPy and pandas become seconds."""
    array = np.asarray(values)
    if np.issubdtype(array.dtype, np.timedelta64):
        array = array / np.timedelta64(1, "s")
    try:
        if np.issubdtype(array.dtype, np.datetime64):
            raise ValueError
        numbers = array.astype(np.float64)
    except (TypeError, ValueError):
        numbers = np.empty((0, 0))
    if numbers.ndim != 1:
        raise FileFormatError(
            f"no row of numbers, but {array.dtype} of shape {array.shape}",
            "give one number for each time stamp, and the time in seconds",
            Where(file=name, channel=column),
        )
    return numbers


def _compute_digest(channels: Iterable[RawChannel]) -> str:
    digest = hashlib.sha256()
    for one in channels:
        digest.update(repr((one.name, one.unit, one.values.size)).encode())
        digest.update(one.time.tobytes() + one.values.tobytes())
    return digest.hexdigest()
