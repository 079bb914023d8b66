# SPDX-License-Identifier: MIT
"""Frames that a logger recorded raw in an MDF 4 file (ASAM MDF, bus logging)."""

from __future__ import annotations

from pathlib import PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.atomic import LARGEST_RECORD
from drivetwin.logs.formats.frames import (
    EXTENDED_BIT,
    FD_LENGTHS,
    LARGEST_IDENTIFIER,
    PAYLOAD,
    Frames,
)
from drivetwin.logs.raw import subtract_origin

DATA_FRAME = "CAN_DataFrame"
"""Name of the record of a data frame; its parts follow after a dot."""

_RECORDS = frozenset(f"CAN_{kind}Frame" for kind in ("Data", "Remote", "Error", "Overload"))
_EMBEDDED = 1
"""Flag of an attachment that stands in the file itself."""

_DATABASE_TYPES = ("application/x-dbc", "application/dbc", "text/dbc")
"""Types by which recorders mark an attached DBC file."""

_LENGTHS = np.array(FD_LENGTHS, np.uint8)


def has_only_frames(group: Any) -> bool:
    """Return True if a group of a file holds raw frames and no signals."""
    return any(str(channel.name).partition(".")[0] in _RECORDS for channel in group.channels)


def read_attached_databases(mdf: Any) -> dict[str, bytes]:
    """Return the contents of the DBC files inside a file by their names.

    A file that it only refers to is not looked for.
    """
    found: dict[str, bytes] = {}
    for index, one in enumerate(getattr(mdf, "attachments", ())):
        name = PureWindowsPath(str(one.file_name)).name  # of either system
        is_database = name.casefold().endswith(".dbc") or str(one.mime) in _DATABASE_TYPES
        if not is_database or not one.flags & _EMBEDDED or one.original_size > LARGEST_RECORD:
            continue
        found[name or f"attachment {index}"] = bytes(mdf.extract_attachment(index=index)[0])
    return found


def read_bus_frames(mdf: Any, origin: float) -> Frames | None:
    """Return the data frames of all groups in order of time; None where the file has none.

    Their time counts from the `origin` of the file [s].
    Frames whose stamp is no number are left out and counted.
    """
    parts = [
        part
        for number in range(len(mdf.groups))
        if number in mdf.masters_db and (part := _read_group_frames(mdf, number)) and part.time.size
    ]
    if not parts:
        return None
    width = max(part.data.shape[1] for part in parts)
    time = np.concatenate([part.time for part in parts])
    order = np.argsort(time, kind="stable")
    order = order[np.isfinite(time[order])]
    lost = time.size - order.size
    names = tuple(dict.fromkeys(name for part in parts for name in part.buses))
    bus = [np.array([names.index(name) for name in part.buses])[part.bus] for part in parts]
    padded = [
        np.pad(part.data, ((0, 0), (0, width - part.data.shape[1])), constant_values=0xFF)
        for part in parts
    ]
    return Frames(
        time=subtract_origin(time[order], origin),
        identifier=np.concatenate([part.identifier for part in parts])[order],
        extended=np.concatenate([part.extended for part in parts])[order],
        data=np.concatenate(padded)[order],
        length=np.concatenate([part.length for part in parts])[order],
        bus=np.concatenate(bus)[order],
        buses=names,
        warnings=(f"{lost} frames without a time stamp left out",) if lost else (),
    )


def _read_group_frames(mdf: Any, number: int) -> Frames | None:
    """The frames of one group; parts that the logger left out have their usual meaning."""
    names = frozenset(str(channel.name) for channel in mdf.groups[number].channels)

    def part(name: str) -> NDArray[Any] | None:
        if f"{DATA_FRAME}.{name}" not in names:
            return None
        samples, _ = mdf.get(
            f"{DATA_FRAME}.{name}",
            group=number,
            raw=True,
            samples_only=True,
            ignore_invalidation_bits=True,
        )
        return np.asarray(samples)

    time = np.asarray(mdf.get_master(number), np.float64)
    stated, data = part("ID"), part("DataBytes")
    if stated is None or data is None or data.ndim != 2 or data.dtype != np.uint8:
        return None
    raw = stated.astype(np.int64)
    ide, length, code, bus = part("IDE"), part("DataLength"), part("DLC"), part("BusChannel")
    if length is None:
        length = np.full(time.size, data.shape[1]) if code is None else _LENGTHS[code & 0xF]
    length = np.minimum(length, data.shape[1]).astype(np.uint8)
    width = max(PAYLOAD, int(length.max(initial=0)))
    inside = np.arange(data.shape[1]) < length[:, None]
    filled = np.where(inside, data, np.uint8(0xFF))[:, :width]
    filled = np.pad(filled, ((0, 0), (0, width - filled.shape[1])), constant_values=0xFF)
    channel = np.zeros(time.size, np.int64) if bus is None else bus.astype(np.int64)
    used, place = np.unique(channel, return_inverse=True)
    return Frames(
        time=time,
        identifier=(raw & LARGEST_IDENTIFIER[True]).astype(np.uint32),
        extended=np.asarray((raw & EXTENDED_BIT) != 0 if ide is None else ide != 0),
        data=filled,
        length=length,
        bus=place.astype(np.intp),
        buses=tuple(f"channel {one}" for one in used.tolist()),
    )
