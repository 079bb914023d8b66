# SPDX-License-Identifier: MIT
"""Where a fault lies is told as exactly as it is known."""

from __future__ import annotations

from drivetwin.errors import Where


def test_times_keep_their_milliseconds_in_a_long_log() -> None:
    told = str(Where("drive.mf4", "TrqOut", 12345.678))
    assert told == "drive.mf4, channel 'TrqOut', t = 12345.678 s"
