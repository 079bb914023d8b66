# SPDX-License-Identifier: MIT
"""Time left of a step, from the time gone and the share that is done."""

from __future__ import annotations

from collections.abc import Callable
from math import exp
from time import monotonic

_QUIET = 1.0
"""Time [s] for which a step is shown without numbers: most are over by then."""
_EARLY = 0.05
"""Share done below which the time left would be a guess."""
_SMOOTHING = 0.1
"""Part of the time gone over which the estimates of the whole time are averaged."""


class Remaining:
    """A line of text on a running step; reads anew each time it is shown."""

    def __init__(self, text: str, clock: Callable[[], float] = monotonic) -> None:
        self._text = text
        self._clock = clock
        self._start = clock()
        self._share = 0.0
        self._what = ""
        self._whole: float | None = None
        self._latest = 0.0

    def update(self, share: float, what: str) -> None:
        """Listener of the computation, see `drivetwin._util.progress`."""
        if share > self._share:
            gone = self._clock() - self._start
            whole = gone / share
            if self._whole is not None:
                kept = exp(-(gone - self._latest) / max(_SMOOTHING * gone, 1e-9))
                whole += kept * (self._whole - whole)
            self._whole, self._latest = whole, gone
        self._share, self._what = share, what

    def estimate_time_left(self) -> float | None:
        """Estimate the time left [s]; None early in a step and where it takes longer than
        estimated."""
        gone = self._clock() - self._start
        if self._whole is None or gone < _QUIET or not _EARLY <= self._share < 1.0:
            return None
        left = self._whole - gone
        return left if left > 0.0 else None

    def __str__(self) -> str:
        gone = self._clock() - self._start
        if gone < _QUIET:
            return self._text
        doing = f"{self._text}, {self._what}" if self._what else self._text
        share = f"{100.0 * self._share:.0f} %, " if _EARLY <= self._share < 1.0 else ""
        left = self.estimate_time_left()
        if left is None:
            return f"{doing}: {share}{format_duration(gone)} so far"
        return f"{doing}: {share}about {format_duration(left)} left"


def format_duration(seconds: float) -> str:
    """Rounded to what a waiting person needs: seconds, minutes, hours."""
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    if seconds < 3600.0:
        return f"{round(seconds / 60.0)} min"
    return f"{seconds / 3600.0:.1f} h"
