# SPDX-License-Identifier: MIT
"""SIGTERM as Ctrl-C; signals wait while files are replaced."""

from __future__ import annotations

import signal

import pytest

from drivetwin._util.interrupts import defer_interrupts, interrupt_on_sigterm


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_wait_for_the_end_of_the_block(number: int) -> None:
    before = signal.getsignal(signal.SIGTERM)
    reached = []

    def write() -> None:
        with defer_interrupts():
            signal.raise_signal(number)
            reached.append(True)

    interrupt_on_sigterm()
    try:
        with pytest.raises(KeyboardInterrupt):
            write()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert reached
