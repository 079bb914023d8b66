# SPDX-License-Identifier: MIT
"""Progress of long computations, reported to a listener.

A computation reports its completed share by `notify_progress(0.4)`. `with scale_progress(...)` maps
the share of a step to the share of the whole. Without a listener both have no effect. A listener
cancels the computation by raising an exception.
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
    """Largest share reported so far; keeps progress monotonic when a search restarts."""

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
def attach_listener(listener: Listener) -> Iterator[None]:
    """Report the progress of this thread inside the block to `listener`."""
    token = _present.set(_Span(listener, 0.0, 1.0, "", _Highest()))
    try:
        yield
    finally:
        _present.reset(token)


@contextmanager
def scale_progress(start: float, end: float, text: str = "") -> Iterator[None]:
    """Map progress inside the block to `start` to `end` of the current part.

    `text` describes the step; empty keeps the previous text.
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
        notify_progress(0.0)
        yield
        notify_progress(1.0)
    finally:
        _present.reset(token)


def notify_progress(share: float, text: str = "") -> None:
    """Report that `share` (0 to 1) of the current part is done, and its step if `text` is given."""
    span = _present.get()
    if span is None:
        return
    inside = min(max(share, 0.0), 1.0)
    span.highest.share = max(span.highest.share, span.start + inside * (span.end - span.start))
    span.listener(span.highest.share, text or span.text)
