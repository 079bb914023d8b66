# SPDX-License-Identifier: MIT
"""Opening a bus log of any form with its databases, MDF files with frames included."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.atomic import LARGEST_RECORD
from drivetwin._util.optional_dependencies import handle_parser_errors, import_extra
from drivetwin.channels.roles import ReadOptions
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
from drivetwin.logs.formats.can.database import (
    EXTENDED_BIT,
    FD_LENGTHS,
    LARGEST_IDENTIFIER,
    LONGEST,
    PAYLOAD,
    Frames,
    build_frames,
    describe_left_out,
    load_driveline_messages,
    parse_database,
    read_database,
)
from drivetwin.logs.formats.can.j1939 import match_groups
from drivetwin.logs.formats.can.recording import BusRecording
from drivetwin.logs.formats.can.texts import read_bus_text
from drivetwin.logs.raw import Recording, subtract_origin

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


@contextmanager
def open_bus_text(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a bus log in text format.

    Raises FileFormatError, MissingExtraError, MissingChannelError.
    """
    yield decode_recording(read_bus_text(path.read_bytes(), str(path)), options, path)


@contextmanager
def open_blf(path: Path, options: ReadOptions) -> Iterator[Recording]:
    """Open a BLF log; raises FileFormatError, MissingExtraError, MissingChannelError."""
    yield decode_recording(read_blf(path), options, path)


def decode_recording(
    frames: Frames, options: ReadOptions, path: Path, attached: Mapping[str, bytes] | None = None
) -> BusRecording:
    """Decode frames by the databases stated, else those `attached` to the log, else the built-in.

    `attached` are the contents by name. Raises FileFormatError, MissingChannelError,
    MissingExtraError.
    """
    notes: tuple[str, ...] = ()
    if options.bus.databases:
        stated = read_database(options.bus.databases)
    elif attached:
        parsed = (
            parse_database(data, path.with_name(f"{path.name} (attached {name})"))
            for name, data in attached.items()
        )
        stated = tuple(message for one in parsed for message in one)
        notes = (f"frames decoded by the attached database {', '.join(attached)}",)
    else:
        stated = load_driveline_messages()
    messages, matched = match_groups(frames, stated, load_driveline_messages)
    frames = replace(frames, warnings=(*frames.warnings, *notes, *matched))
    return BusRecording(frames, messages, options.bus, path)


_RANGE = 2.0**64 * 1e-9
"""Time [s] after which 64 bits of nanoseconds start again."""


def read_blf(path: Path) -> Frames:
    """Read the data frames of a BLF file; raises MissingExtraError, FileFormatError."""
    kind = "a BLF bus log"
    can = import_extra("can", "can", kind, path)
    with path.open("rb") as file, handle_parser_errors(kind, path):
        return _read_frames(can.BLFReader(file), kind, path)


def _read_frames(reader: Any, kind: str, path: Path) -> Frames:
    """The table of data frames; what breaks off is read up to there."""
    messages: list[Any] = []
    size = path.stat().st_size
    cut = f"the file is cut: {size} of the {reader.file_size} bytes that its head states"
    broken: tuple[str, ...] = (cut,) if size < reader.file_size else ()
    try:
        with handle_parser_errors(kind, path):
            messages.extend(reader)
    except FileFormatError as fault:
        if not messages:
            raise
        broken += (f"{fault.what}; {len(messages)} frames were read before",)
    frames = [one for one in messages if _is_data(one)]
    if not frames:
        raise FileFormatError("no frame can be read", "record it again", Where(file=str(path)))
    stamps = [one.timestamp for one in frames]
    return build_frames(
        _count_from_start(stamps, reader.start_timestamp).tolist(),
        [one.arbitration_id for one in frames],
        [one.is_extended_id for one in frames],
        [bytes(one.data) for one in frames],
        [f"channel {one.channel}" for one in frames],
        (*describe_left_out(len(messages), len(messages) - len(frames), len(frames)), *broken),
    )


def _is_data(message: Any) -> bool:
    is_other = message.is_remote_frame or message.is_error_frame
    return not is_other and len(message.data) <= LONGEST


def _count_from_start(stamps: Sequence[float], start: float) -> FloatArray:
    """Return the time [s] from the start of the measurement, negative before its trigger.

    The file counts in 64 bits without a sign: a negative time arrives as a very late one.
    """
    time = np.array(stamps, np.float64) - start
    return np.where(time > 0.5 * _RANGE, time - _RANGE, time)
