# SPDX-License-Identifier: MIT
"""The frames of a bus log as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.errors import FileFormatError, Where
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

FrameRow = tuple[float, int, bool, bytes, str]
"""Time stamp [s], identifier, whether it is extended, payload and bus of a data frame."""

FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Data bytes by the length code of CAN FD."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Data frames in file order.

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
    time = np.array(stamps, np.float64)
    names = tuple(dict.fromkeys(buses))
    index = {name: place for place, name in enumerate(names)}
    width = max(PAYLOAD, max(map(len, payloads), default=0))
    padded = b"".join(payload.ljust(width, b"\xff") for payload in payloads)
    origin = find_origin(time[:1])
    return Frames(
        time=subtract_origin(time, origin),
        identifier=np.array(identifiers, np.uint32),
        extended=np.array(extended, np.bool_),
        data=np.frombuffer(padded, np.uint8).reshape(-1, width),
        length=np.array([len(payload) for payload in payloads], np.uint8),
        bus=np.array([index[name] for name in buses], np.intp),
        buses=names,
        warnings=(*warnings, *describe_origin(origin)),
    )


def collect_frames(
    rows: Sequence[FrameRow], file: str, *, lines: int, other: int = 0, notes: tuple[str, ...] = ()
) -> Frames:
    """Build the table from the data frames of a file.

    Parameters
    ----------
    rows
        Data frames in file order.
    file
        File, for messages.
    lines
        Number of lines or messages of the file that are meant as frames.
    other
        Number of remote and error frames among them; the rest is damaged.
    notes
        Further warnings.

    Returns
    -------
    Frames
        The frames; its warnings count what was left out.

    Raises
    ------
    FileFormatError
        Without a single frame.
    """
    if not rows:
        raise FileFormatError("no frame in the file", "record it again", Where(file=file))
    warnings = [f"{other} remote or error frames left out"] if other else []
    if damaged := lines - other - len(rows):
        warnings.append(f"{damaged} damaged lines left out of {lines}")
    stamps, identifiers, extended, payloads, buses = zip(*rows, strict=True)
    return build_frames(stamps, identifiers, extended, payloads, buses, (*warnings, *notes))
