# SPDX-License-Identifier: MIT
"""How far a long computation is, told to whoever listens.

A computation says `tell(0.4)` where it knows that much of itself to be done, and `with part(...)`
gives a piece of it its place in the whole; without a listener both do nothing. A listener that
raises stops the computation: that is how it is cancelled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace

Listener = Callable[[float, str], None]
"""Called with the share done (0 to 1, never falling) and what is being done."""


@dataclass
class _Highest:
    """The largest share told so far: a search that starts again does not turn the clock back."""

    share: float = 0.0


@dataclass(frozen=True)
class _Span:
    """Place of the present piece in the whole, and who listens."""

    listener: Listener
    start: float
    end: float
    text: str
    highest: _Highest


_present: ContextVar[_Span | None] = ContextVar("drivetwin_progress", default=None)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Tell `listener` of all computations of this thread inside the block."""
    token = _present.set(_Span(listener, 0.0, 1.0, "", _Highest()))
    try:
        yield
    finally:
        _present.reset(token)


@contextmanager
def part(start: float, end: float, text: str = "") -> Iterator[None]:
    """What is told inside the block counts from `start` to `end` of the present piece.

    `text` says what is being done; empty keeps what was said before.
    """
    span = _present.get()
    if span is None:
        yield
        return
    width = span.end - span.start
    inside = replace(
        span,
        start=span.start + start * width,
        end=span.start + end * width,
        text=text or span.text,
    )
    token = _present.set(inside)
    try:
        tell(0.0)
        yield
        tell(1.0)
    finally:
        _present.reset(token)


def tell(share: float) -> None:
    """Say that `share` (0 to 1) of the present piece is done."""
    span = _present.get()
    if span is None:
        return
    inside = min(max(share, 0.0), 1.0)
    span.highest.share = max(span.highest.share, span.start + inside * (span.end - span.start))
    span.listener(span.highest.share, span.text)
