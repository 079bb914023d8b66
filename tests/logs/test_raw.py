# SPDX-License-Identifier: MIT
"""Recordings that keep what was read."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.read_options import Column
from drivetwin.logs.raw import RawChannel, Remembered, Window


class Counted:
    """Two columns of ten samples; counts what is loaded."""

    columns = (Column("a"), Column("b"))
    warnings = ("one",)

    def __init__(self) -> None:
        self.loaded: list[int] = []

    def load(self, index: int, window: Window | None = None) -> RawChannel:
        """Read a column."""
        self.loaded.append(index)
        time = np.arange(10.0)
        return RawChannel("ab"[index], None, time, time + index).select_window(window)


def test_a_channel_is_loaded_once() -> None:
    source = Counted()
    recording = Remembered(source)
    assert recording.columns == source.columns
    assert recording.warnings == source.warnings
    whole = recording.load(1)
    part = recording.load(1, (2.0, 4.0))
    assert whole.values.size == 10
    assert part.values.tolist() == [3.0, 4.0, 5.0]
    assert source.loaded == [1]


def test_what_does_not_fit_is_loaded_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivetwin.logs.raw.MOST_REMEMBERED", 15)
    source = Counted()
    recording = Remembered(source)
    for index in (0, 1, 0, 1):
        recording.load(index)
    assert source.loaded == [0, 1, 1]
