# SPDX-License-Identifier: MIT
"""Where a fault lies is told as exactly as it is known."""

from __future__ import annotations

import pickle

from drivetwin.errors import UnitError, Where


def test_times_keep_their_milliseconds_in_a_long_log() -> None:
    told = str(Where("drive.mf4", "TrqOut", 12345.678))
    assert told == "drive.mf4, channel 'TrqOut', t = 12345.678 s"


def test_an_error_passes_between_processes_and_into_sets() -> None:
    error = UnitError("unknown unit 'x'", remedy="name it", where=Where(channel="TrqOut"))
    back = pickle.loads(pickle.dumps(error))
    assert (type(back), str(back)) == (UnitError, str(error))
    assert {error, back} - {error} == {back}
