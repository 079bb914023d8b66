# SPDX-License-Identifier: MIT
"""Time left of a step, from the share that is done."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

_QUIET = 1.0
"""Time [s] for which a step is shown without numbers: most are over by then."""
_EARLY = 0.02
"""Share done below which the time left would be a guess."""


class Remaining:
    """A line of text on a running step; reads anew each time it is shown."""

    def __init__(self, text: str, clock: Callable[[], float] = monotonic) -> None:
        self._text = text
        self._clock = clock
        self._start = clock()
        self._share = 0.0
        self._what = ""
        self._end = self._start

    def update(self, share: float, what: str) -> None:
        """Listener of the computation, see `drivetwin._util.progress`."""
        if share > self._share:
            now = self._clock()
            self._end = now + (now - self._start) * (1.0 - share) / share
        self._share, self._what = share, what

    def __str__(self) -> str:
        now = self._clock()
        if now - self._start < _QUIET:
            return self._text
        doing = f"{self._text}, {self._what}" if self._what else self._text
        if not _EARLY <= self._share < 1.0:
            return f"{doing}: {format_duration(now - self._start)}"
        left = format_duration(max(self._end - now, 0.0))
        return f"{doing}: {100.0 * self._share:.0f} %, about {left} left"


def format_duration(seconds: float) -> str:
    """Rounded to what a waiting person needs: seconds, minutes, hours."""
    if seconds < 60.0:
        return f"{max(1, round(seconds))} s"
    if seconds < 3600.0:
        return f"{round(seconds / 60.0)} min"
    return f"{seconds / 3600.0:.1f} h"
