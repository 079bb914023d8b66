# SPDX-License-Identifier: MIT
"""SIGTERM as Ctrl-C; signals wait while files are replaced; interrupted imports are interrupts."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

import drivetwin.cli
from drivetwin.__main__ import main
from drivetwin._util import atomic
from drivetwin._util.atomic import (
    defer_interrupts,
    interrupt_on_signals,
)
from drivetwin.errors import INTERRUPTED

ENDING = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])


@pytest.fixture(autouse=True)
def _own_handlers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Handlers of the tests as they were before."""
    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(atomic, "_raised", [])
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for one, handler in before.items():
        signal.signal(one, handler)


@ENDING
def test_signals_wait_for_the_end_of_the_block(number: int) -> None:
    reached = []

    def write() -> None:
        with defer_interrupts():
            signal.raise_signal(number)
            reached.append(True)

    interrupt_on_signals()
    with pytest.raises(KeyboardInterrupt):
        write()
    assert reached


def interrupt_import(number: int | None) -> int:
    """Fail as an extension module does that is interrupted while it is imported."""
    try:
        if number is not None:
            signal.raise_signal(number)
    except KeyboardInterrupt as fault:
        raise ImportError("initialization failed") from fault
    raise ImportError("no such module")


@ENDING
def test_an_interrupted_import_is_an_interrupt(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    monkeypatch.setattr(drivetwin.cli, "main", lambda: interrupt_import(number))
    assert main() == INTERRUPTED


def test_other_failures_of_imports_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drivetwin.cli, "main", lambda: interrupt_import(None))
    with pytest.raises(ImportError, match="no such module"):
        main()
