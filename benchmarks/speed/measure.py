# SPDX-License-Identifier: MIT
"""Entries of the comparison, measured in turns so that all see the same machine."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from tests.support.upshift.statement import Solution


@dataclass(frozen=True)
class Sample:
    """Seconds of some runs, one by one, and what the last of them found."""

    seconds: Sequence[float]
    solution: Solution | None


class Group(StrEnum):
    """The table that an entry belongs to."""

    SHIFT = "One shift"
    GENERAL = "Larger and other drivelines"
    DERIVATIVES = "Derivatives"


@dataclass(frozen=True)
class Quality:
    """How far a solution is off: the error with its unit, and that of the events [s]."""

    error: float
    unit: str
    events: float | None = None


Judge = Callable[[Solution], Quality | None]


@dataclass(frozen=True)
class Entry:
    """One program with one setting; `run` does some runs, in at most `rounds` rounds.

    `judge` compares what it found with what is right.
    """

    program: str
    setting: str
    run: Callable[[], Sample]
    judge: Judge
    group: Group = Group.SHIFT
    rounds: int = 1000


@dataclass
class Measured:
    """All seconds of an entry."""

    entry: Entry
    seconds: list[float] = field(default_factory=list)
    solution: Solution | None = None

    @property
    def quality(self) -> Quality | None:
        """Error of the last solution."""
        return None if self.solution is None else self.entry.judge(self.solution)

    @property
    def median(self) -> float:
        """Median time of a run [s]."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """Shortest time of a run [s]; on a busy machine nearer to the truth."""
        return min(self.seconds)


def time_runs(run: Callable[[], Solution], repeats: int) -> Sample:
    """Time `repeats` runs, the conversion of the last result to a Solution not among them."""
    seconds = []
    for _ in range(repeats):
        begin = time.perf_counter()
        result = run()
        seconds.append(time.perf_counter() - begin)
    return Sample(seconds, result)


def measure(entries: Sequence[Entry], rounds: int, tell: Callable[[str], None]) -> list[Measured]:
    """Run all entries in turns, `rounds` times."""
    found = [Measured(entry) for entry in entries]
    for number in range(rounds):
        for one in found:
            if number < one.entry.rounds:
                tell(f"round {number + 1}/{rounds}: {one.entry.program} {one.entry.setting}")
                sample = one.entry.run()
                one.seconds += sample.seconds
                one.solution = sample.solution or one.solution
    return found
