# SPDX-License-Identifier: MIT
"""The built-in messages are those that a library reads from the same file."""

from __future__ import annotations

from importlib.resources import as_file, files

import pytest

from drivetwin.logs.formats.can.database import load_driveline_messages, read_database


def test_equal_to_what_cantools_reads() -> None:
    pytest.importorskip("cantools")
    with as_file(files("drivetwin.logs.formats.j1939") / "driveline.dbc") as path:
        expected = read_database((path,))
    found = load_driveline_messages()
    assert [one.name for one in found] == [one.name for one in expected]
    for own, other in zip(found, expected, strict=True):
        key = lambda signal: signal.name  # noqa: E731
        assert sorted(own.signals, key=key) == sorted(other.signals, key=key)
        assert (own.identifier, own.extended, own.j1939) == (
            other.identifier,
            other.extended,
            other.j1939,
        )


def test_every_signal_of_the_file_is_read() -> None:
    text = (files("drivetwin.logs.formats.j1939") / "driveline.dbc").read_text()
    messages = load_driveline_messages()
    assert sum(len(one.signals) for one in messages) == text.count("\n SG_ ")
    assert len(messages) == text.count("\nBO_ ")
