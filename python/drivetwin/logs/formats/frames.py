# SPDX-License-Identifier: MIT
"""The frames of a bus log as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.raw import describe_origin, find_origin, subtract_origin


@dataclass(frozen=True)
class Signal:
    """One signal of a message: value = `scale`·code + `offset` in `unit`.

    `start` is the bit as a DBC counts it (least significant bit for Intel, most significant for
    Motorola order). `limits` are the least and greatest value that is one, None where the database
    states none. `selector` is the code of the multiplexer (start, length) that admits the signal.
    `spn` is its SAE J1939 number. `texts` are the codes that the database names.
    """

    name: str
    start: int
    length: int
    intel: bool = True
    signed: bool = False
    is_float: bool = False
    scale: float = 1.0
    offset: float = 0.0
    unit: str | None = None
    limits: tuple[float, float] | None = None
    selector: tuple[Signal, frozenset[int]] | None = None
    spn: int | None = None
    texts: tuple[tuple[int, str], ...] = ()

    @property
    def end(self) -> int:
        """Number of bytes that a frame must have to hold the signal."""
        if self.intel:
            return (self.start + self.length + 7) // 8
        return self.start // 8 + (7 - self.start % 8 + self.length + 7) // 8


@dataclass(frozen=True)
class Message:
    """A message: `identifier` of 11 bits, or 29 if `extended`; `j1939`: only its group counts."""

    name: str
    identifier: int
    extended: bool
    j1939: bool
    signals: tuple[Signal, ...]


PAYLOAD, LONGEST = 8, 64
"""Most data bytes of a classical frame, and of one of CAN FD."""

EXTENDED_BIT = 1 << 31
"""Bit of an identifier by which files mark 29 bits."""

LARGEST_IDENTIFIER = {False: 0x7FF, True: 0x1FFFFFFF}
"""Largest identifier of a standard and of an extended frame."""

FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Data bytes by the length code of CAN FD."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Data frames of a log; those far too early are in file order, the others in order of time.

    `time` (n,) [s]; `identifier` (n,) has 29 bits where `extended` (n,) is true, else 11; `data`
    (n, width) is padded with 0xFF, as wide as the longest and at least 8; `length` (n,) is the
    number of valid bytes; `bus` (n,) is an index into `buses`.
    """

    time: FloatArray
    identifier: NDArray[np.uint32]
    extended: NDArray[np.bool_]
    data: NDArray[np.uint8]
    length: NDArray[np.uint8]
    bus: NDArray[np.intp]
    buses: tuple[str, ...]
    warnings: tuple[str, ...] = field(default=())


def build_frames(
    stamps: Sequence[float],
    identifiers: Sequence[int],
    extended: Sequence[bool],
    payloads: Sequence[bytes],
    buses: Sequence[str],
    warnings: tuple[str, ...] = (),
) -> Frames:
    """Build the table from one entry for each frame; payloads have at most LONGEST bytes."""
    names = tuple(dict.fromkeys(buses))
    index = {name: place for place, name in enumerate(names)}
    width = max(PAYLOAD, max(map(len, payloads), default=0))
    padded = b"".join(payload.ljust(width, b"\xff") for payload in payloads)
    frames = Frames(
        time=np.array(stamps, np.float64),
        identifier=np.array(identifiers, np.uint32),
        extended=np.array(extended, np.bool_),
        data=np.frombuffer(padded, np.uint8).reshape(-1, width),
        length=np.array([len(payload) for payload in payloads], np.uint8),
        bus=np.array([index[name] for name in buses], np.intp),
        buses=names,
        warnings=warnings,
    )
    return arrange_frames(frames)


def join_frames(parts: Sequence[Frames], buses: tuple[str, ...]) -> Frames:
    """Join tables whose `bus` is an index into `buses`."""
    width = max((part.data.shape[1] for part in parts), default=PAYLOAD)
    data = [
        np.pad(part.data, ((0, 0), (0, width - part.data.shape[1])), constant_values=0xFF)
        if part.data.shape[1] < width
        else part.data
        for part in parts
    ]
    return Frames(
        time=np.concatenate([part.time for part in parts]),
        identifier=np.concatenate([part.identifier for part in parts]),
        extended=np.concatenate([part.extended for part in parts]),
        data=np.concatenate(data),
        length=np.concatenate([part.length for part in parts]),
        bus=np.concatenate([part.bus for part in parts]),
        buses=buses,
    )


def arrange_frames(frames: Frames) -> Frames:
    """Sort frames that others of their bus overtook; count time from the origin.

    The warnings of the table come first.
    """
    order, remarks = _sort_overtaken(frames.time, frames.bus)
    origin = find_origin(frames.time[:1])
    warnings = (*frames.warnings, *remarks, *describe_origin(origin))
    time = subtract_origin(frames.time, origin)
    if order is None:
        return replace(frames, time=time, warnings=warnings)
    return Frames(
        time=time[order],
        identifier=frames.identifier[order],
        extended=frames.extended[order],
        data=frames.data[order],
        length=frames.length[order],
        bus=frames.bus[order],
        buses=frames.buses,
        warnings=warnings,
    )


OVERTAKEN = 0.02
"""Time [s] by which a frame may be stamped before an earlier one of its bus: queues of a logger,
order of interrupts."""
_STAMP_DECIMALS = 6
"""Decimals [s] that the stamp of a clock from 1970 on can hold."""
MOST_EARLIER, FEW_EARLIER = 0.01, 3
"""Share of frames that may be stamped still earlier, and how many of a short log [count]."""


def _sort_overtaken(
    time: FloatArray, bus: NDArray[np.intp]
) -> tuple[NDArray[np.intp] | None, tuple[str, ...]]:
    """Return the order of frames by `time` (n,) [s] on each bus, and a remark; None if in order.

    Frames that are stamped earlier by more than `OVERTAKEN` keep their place. With many of them a
    bus stays as it is: its clock was set, and it is open which stamps are right.
    """
    if np.all(time[1:] >= time[:-1]):
        return None, ()
    order, count, most = np.arange(time.size), 0, 0.0
    for one in np.unique(bus):
        rows = np.flatnonzero(bus == one)
        latest = np.maximum.accumulate(time[rows])
        late = np.round(latest - time[rows], _STAMP_DECIMALS)
        is_far = late > OVERTAKEN
        is_moved = (late > 0.0) & ~is_far
        if is_moved.any() and is_far.sum() <= max(FEW_EARLIER, MOST_EARLIER * rows.size):
            key = np.where(is_far, latest, time[rows])
            order[rows] = rows[np.argsort(key, kind="stable")]
            count += int(is_moved.sum())
            most = max(most, 1e3 * float(late[is_moved].max()))
    if not count:
        return None, ()
    return order, (f"{count} frames out of order by up to {most:.3g} ms sorted by their stamps",)


def describe_left_out(lines: int, other: int, count: int) -> tuple[str, ...]:
    """Count what was left out of `lines` meant as frames: `other` frames, and damaged lines.

    `count` frames were read.
    """
    notes = (f"{other} remote or error frames left out",) if other else ()
    damaged = lines - other - count
    return (*notes, f"{damaged} damaged lines left out of {lines}") if damaged else notes
