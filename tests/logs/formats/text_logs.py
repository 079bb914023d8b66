# SPDX-License-Identifier: MIT
"""Text logs from bytes."""

from __future__ import annotations

from io import BytesIO

from drivetwin.channels.roles import TimeColumn
from drivetwin.errors import DamagedChannelError
from drivetwin.logs.formats.csv import read_table
from drivetwin.logs.raw import RawLog


def read_csv(data: bytes, file: str = "log.csv", time: TimeColumn | None = None) -> RawLog:
    """Read all columns of a text log that is in memory."""
    recording = read_table(BytesIO(data), file, time or TimeColumn())
    channels, unreadable = [], {}
    for index, column in enumerate(recording.columns):
        try:
            channels.append(recording.load(index))
        except DamagedChannelError as fault:
            unreadable[column.name] = fault.what
    return RawLog(tuple(channels), unreadable, recording.warnings, file)
