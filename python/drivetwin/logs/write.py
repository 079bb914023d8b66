# SPDX-License-Identifier: MIT
"""Logs to files that every reader here takes back: CSV, MDF 4, MATLAB, Parquet.

Time bases and numbers come back as they were: a table row exists where any channel has a sample,
and the others are empty there.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from drivetwin._util.atomic import open_atomic
from drivetwin._util.optional_dependencies import import_extra
from drivetwin._util.text import format_csv_row
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.channels.units import resolve_channel_unit
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.quality.channel_checks import check_order
from drivetwin.logs.raw import RawChannel

_TIME = "time"


def convert_to_recorded_units(channel: Channel) -> RawChannel:
    """Return a channel of a log under the name and in the unit of its file.

    Raises UnitError where that unit is unknown.
    """
    name, unit = channel.source_name, channel.source_unit
    values = resolve_channel_unit(unit, channel.quantity, Where(channel=name)).from_si(
        channel.values
    )
    return RawChannel(name, unit or None, channel.time, values)


def write_log(path: Path | str, channels: Sequence[RawChannel]) -> None:
    """Write channels in the format of the suffix: .csv, .mf4, .mat or .parquet.

    The file appears whole or not at all, in place of an existing one. Raises FileFormatError for
    another suffix or for names that repeat or cannot stand in the format, TimeError where time does
    not increase, MissingExtraError without the library of the format.
    """
    path = Path(path)
    writer = _WRITERS.get(path.suffix.casefold())
    where = Where(file=str(path))
    if writer is None:
        known = ", ".join(_WRITERS)
        raise FileFormatError(f"no format has the ending {path.suffix!r}", f"use {known}", where)
    names = [channel.name for channel in channels]
    if len(set(names)) < len(names) or _TIME in names:
        raise FileFormatError("names repeat, or one is 'time'", "rename the channels", where)
    for channel in channels:
        check_order(channel.time, Where(file=str(path), channel=channel.name))
    with open_atomic(path) as file:
        writer(file, path, channels)


def _build_table(
    channels: Sequence[RawChannel],
) -> tuple[FloatArray, list[FloatArray], list[FloatArray]]:
    """All stamps (n,), and for each channel its column (n,) with a mask (n,) of its samples."""
    time = np.unique(np.concatenate([channel.time for channel in channels]))
    columns, masks = [], []
    for channel in channels:
        place = np.searchsorted(time, channel.time)
        column, mask = np.full(time.size, np.nan), np.zeros(time.size)
        column[place], mask[place] = channel.values, 1.0
        columns.append(column)
        masks.append(mask)
    return time, columns, masks


def _write_csv(file: BinaryIO, _: Path, channels: Sequence[RawChannel]) -> None:
    time, columns, masks = _build_table(channels)
    texts = [[repr(stamp) for stamp in time.tolist()]]
    for column, mask in zip(columns, masks, strict=True):
        cells = zip(column.tolist(), mask.tolist(), strict=True)
        texts.append([_format_cell(value) if there else "" for value, there in cells])
    names = [_TIME, *(channel.name for channel in channels)]
    units = ["s", *(channel.unit or "" for channel in channels)]
    rows = [
        format_csv_row(names),
        format_csv_row(units),
        *(",".join(row) + "\n" for row in zip(*texts, strict=True)),
    ]
    file.write("".join(rows).encode("utf-8"))


def _format_cell(value: float) -> str:
    return repr(value) if np.isfinite(value) else "NaN"


def _write_parquet(file: BinaryIO, path: Path, channels: Sequence[RawChannel]) -> None:
    import_extra("pyarrow", "io", "a Parquet file", path)
    import pyarrow as pa
    import pyarrow.parquet as pq

    time, columns, masks = _build_table(channels)
    fields = [pa.field(_TIME, pa.float64(), metadata={"unit": "s"})]
    arrays = [pa.array(time)]
    for channel, column, mask in zip(channels, columns, masks, strict=True):
        metadata = {"unit": channel.unit} if channel.unit else {}
        fields.append(pa.field(channel.name, pa.float64(), metadata=metadata))
        arrays.append(pa.array(column, mask=mask == 0.0))
    units = {channel.name: channel.unit for channel in channels if channel.unit}
    schema = pa.schema(fields, metadata={"units": json.dumps(units)})
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), file)


def _write_mat(file: BinaryIO, path: Path, channels: Sequence[RawChannel]) -> None:
    from scipy.io import savemat

    content: dict[str, object] = {}
    for channel in channels:
        if not re.fullmatch(r"[A-Za-z]\w{0,57}", channel.name, re.ASCII):
            raise FileFormatError(
                f"{channel.name!r} is no variable name in MATLAB", "rename it", Where(str(path))
            )
        mine: dict[str, object] = {
            channel.name: channel.values,
            f"{channel.name}_t": channel.time,
        }
        if channel.unit:
            mine[f"{channel.name}_unit"] = channel.unit
        if twice := [name for name in mine if name in content]:
            what = f"{twice[0]!r} would be a channel, and time or unit of another"
            raise FileFormatError(what, "rename the channel", Where(str(path)))
        content |= mine
    # SciPy accepts an open file, but its type stubs do not declare it.
    savemat(file, content, long_field_names=True, do_compression=True)  # type: ignore[arg-type]


def _write_mf4(file: BinaryIO, path: Path, channels: Sequence[RawChannel]) -> None:
    asammdf = import_extra("asammdf", "mdf", "an MDF file", path)
    groups: dict[bytes, list[RawChannel]] = {}
    for channel in channels:
        groups.setdefault(channel.time.tobytes(), []).append(channel)
    with asammdf.MDF(version="4.10") as mdf:
        for number, group in enumerate(groups.values(), start=1):
            signals = [
                asammdf.Signal(
                    samples=channel.values,
                    timestamps=channel.time,
                    name=channel.name,
                    unit=channel.unit or "",
                )
                for channel in group
            ]
            mdf.append(signals, acq_name=f"raster {number}", common_timebase=True)
        mdf.save(file, compression=1)


_WRITERS: dict[str, Callable[[BinaryIO, Path, Sequence[RawChannel]], None]] = {
    ".csv": _write_csv,
    ".mf4": _write_mf4,
    ".mat": _write_mat,
    ".parquet": _write_parquet,
}
"""Each writes into an open file; the path is named where that fails."""
