# SPDX-License-Identifier: MIT
"""Progress of long computations, reported to a listener, and shares of time of their stages.

A computation reports its completed share by `notify_progress(0.4)`. `with scale_progress(...)` maps
the share of a step to the share of the whole. Without a listener both have no effect. A listener
cancels the computation by raising an exception.

A computation may declare its stages by name; it enters each of them once, or as often as stated.
Shares are measured, not guessed: the CPU seconds of a stage are read from `stage_seconds.toml`,
which `benchmarks.progress` measures. Stages may be nested.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

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


TABLE = Path(__file__).with_name("stage_seconds.toml")
"""Measured CPU seconds of each stage by computation."""


@dataclass(frozen=True)
class TimedStages:
    """Successive stages of a computation; the first one is never skipped.

    `counts` are the numbers of entries of the stages that are repeated or, with 0, left out.
    """

    computation: str
    names: tuple[str, ...]
    counts: Mapping[str, float] = field(default_factory=dict)

    def repeat(self, name: str, count: float) -> TimedStages:
        """Return the stages with `count` entries of one of them."""
        return replace(self, counts={**self.counts, name: count})

    @contextmanager
    def enter(self, name: str, text: str = "", number: int = 0) -> Iterator[None]:
        """Map progress inside the block to the share of a stage; `number` counts its entries.

        `text` describes the stage; empty keeps the previous text.
        """
        start, end = self.compute_span(name, number)
        with scale_progress(start, end, text):
            yield

    def compute_span(self, name: str, number: int = 0) -> tuple[float, float]:
        """Compute start and end (0 to 1) of an entry in the time of all stages."""
        seconds = _read_table().get(self.computation, {})
        entries = {one: self.count_entries(one) for one in self.names}
        whole = sum(seconds.get(one, 0.0) * count for one, count in entries.items())
        if whole == 0.0:
            return 0.0, 1.0
        place = self.names.index(name)
        before = sum(seconds.get(one, 0.0) * entries[one] for one in self.names[:place])
        own = seconds.get(name, 0.0)
        return (before + number * own) / whole, (before + (number + 1) * own) / whole

    def count_entries(self, name: str) -> float:
        """Return the number of entries of a stage."""
        return self.counts.get(name, 1)


@cache
def _read_table() -> dict[str, dict[str, float]]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))
