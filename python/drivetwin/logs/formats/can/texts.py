# SPDX-License-Identifier: MIT
"""Bus logs in text form: recognition by their first bytes."""

from __future__ import annotations

from collections.abc import Callable

from drivetwin.logs.formats.can.asc import is_asc, read_asc
from drivetwin.logs.formats.can.candump import is_candump, read_candump
from drivetwin.logs.formats.can.gvret import is_gvret, read_gvret
from drivetwin.logs.formats.can.trc import is_trc, read_trc
from drivetwin.logs.formats.frames import Frames
from drivetwin.logs.raw import HEAD_BYTES

_TEXT_FORMATS: tuple[tuple[Callable[[bytes], bool], Callable[[bytes, str], Frames]], ...] = (
    (is_trc, read_trc),
    (is_gvret, read_gvret),
    (is_candump, read_candump),
    (is_asc, read_asc),
)
"""Test of the first bytes, and reader, of each bus log in text form."""


def is_bus_text(head: bytes) -> bool:
    """Return True if the first bytes of a file are a bus log in text form."""
    return any(fits(head) for fits, _ in _TEXT_FORMATS)


def read_bus_text(data: bytes, file: str) -> Frames:
    """Read the frames of a bus log in text form. Raises FileFormatError."""
    return next(read for fits, read in _TEXT_FORMATS if fits(data[:HEAD_BYTES]))(data, file)
