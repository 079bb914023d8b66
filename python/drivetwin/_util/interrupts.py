# SPDX-License-Identifier: MIT
"""Signals that end a program: SIGTERM acts as Ctrl-C, and both wait where files are replaced."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_ENDING = (signal.SIGINT, signal.SIGTERM)
_raised: list[int] = []
"""Signals for which `_interrupt` raised KeyboardInterrupt."""


def interrupt_on_signals() -> None:
    """Let SIGTERM raise KeyboardInterrupt as Ctrl-C does, and remember both.

    A SIGINT that the caller of the program ignores, as for jobs in the background, stays ignored.
    """
    signal.signal(signal.SIGTERM, _interrupt)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)


def was_interrupted() -> bool:
    """Return True after an interrupt, also where its KeyboardInterrupt became another exception.

    An extension module that is interrupted while it is imported raises ImportError.
    """
    return bool(_raised)


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Let signals that end the program wait until the block is through."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {one: signal.signal(one, lambda number, _: came.append(number)) for one in _ENDING}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
        if came:
            signal.raise_signal(came[0])


def _interrupt(number: int, _frame: object) -> None:
    _raised.append(number)
    raise KeyboardInterrupt
