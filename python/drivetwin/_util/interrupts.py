# SPDX-License-Identifier: MIT
"""Signals that end a program: all act as Ctrl-C, and wait where files are replaced."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = tuple(
    signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Signals that end a program: Ctrl-C, a request, a terminal that is closed."""
_raised: list[int] = []
"""Signals for which `_interrupt` raised KeyboardInterrupt."""


def interrupt_on_signals() -> None:
    """Let all signals of `ENDING` raise KeyboardInterrupt as Ctrl-C does, and remember them.

    A signal that the caller of the program ignores stays ignored: SIGINT of jobs in the background,
    SIGHUP below nohup. SIGTERM is never ignored.
    """
    for one in ENDING:
        if one is signal.SIGTERM or signal.getsignal(one) is not signal.SIG_IGN:
            signal.signal(one, _interrupt)


@contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Ignore all signals of `ENDING` while the program cleans up.

    A terminal that is closed sends more than one.
    """
    before = {one: signal.signal(one, signal.SIG_IGN) for one in ENDING}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


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
    before = {one: signal.signal(one, lambda number, _: came.append(number)) for one in ENDING}
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
