# SPDX-License-Identifier: MIT
"""Entries of the comparison, measured in turns so that all see the same machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from tests.support.upshift.statement import Solution


@dataclass(frozen=True)
class Sample:
    """Seconds of some runs, one by one, and the solution of the last of them."""

    seconds: Sequence[float]
    solution: Solution | None


class Group(StrEnum):
    """The table that an entry belongs to."""

    SHIFT = "One shift"
    GENERAL = "Larger and other drivelines"
    DERIVATIVES = "Derivatives"


@dataclass(frozen=True)
class Quality:
    """Error of a solution with its unit, and that of the events [s]."""

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
    """Shortest time of a run in each round [s], and the last solution."""

    entry: Entry
    seconds: list[float] = field(default_factory=list)
    solution: Solution | None = None

    def collect(self) -> dict[str, Any]:
        """Collect the raw result of the entry."""
        quality = None if self.solution is None else self.entry.judge(self.solution)
        error = quality and {"error": quality.error, "unit": quality.unit, "events": quality.events}
        return {
            "group": self.entry.group.value,
            "program": self.entry.program,
            "setting": self.entry.setting,
            "seconds": self.seconds,
            **(error or {}),
        }


def time_runs(run: Callable[[], Solution], repeats: int) -> Sample:
    """Time `repeats` runs by the CPU time of the process."""
    seconds = []
    for _ in range(repeats):
        begin = time.process_time()
        result = run()
        seconds.append(time.process_time() - begin)
    return Sample(seconds, result)


def measure(entries: Sequence[Entry], rounds: int, tell: Callable[[str], None]) -> list[Measured]:
    """Run all entries in turns, `rounds` times."""
    found = [Measured(entry) for entry in entries]
    for number in range(rounds):
        for one in found:
            if number < one.entry.rounds:
                tell(f"round {number + 1}/{rounds}: {one.entry.program} {one.entry.setting}")
                sample = one.entry.run()
                one.seconds.append(min(sample.seconds))
                one.solution = sample.solution or one.solution
    return found
