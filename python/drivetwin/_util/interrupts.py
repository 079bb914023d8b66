# SPDX-License-Identifier: MIT
"""Signals that end a program: SIGTERM acts as Ctrl-C, and both wait where files are replaced."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_ENDING = (signal.SIGINT, signal.SIGTERM)


def interrupt_on_sigterm() -> None:
    """Let SIGTERM raise KeyboardInterrupt, so that it cleans up as Ctrl-C does."""
    signal.signal(signal.SIGTERM, _interrupt)


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


def _interrupt(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt
