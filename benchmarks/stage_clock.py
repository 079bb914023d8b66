# SPDX-License-Identifier: MIT
"""CPU time of the stages that computations declare for their progress."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import process_time
from unittest.mock import patch

from drivetwin._util.progress import TimedStages


@dataclass
class StageClock:
    """Measured stages: `seconds` and numbers of `planned` entries, by (computation, stage)."""

    seconds: dict[tuple[str, str], float] = field(default_factory=dict)
    planned: dict[tuple[str, str], float] = field(default_factory=dict)

    def add(self, stages: TimedStages, name: str, number: int, seconds: float) -> None:
        """Add the time of an entry; the first entry of the first stage plans those of all."""
        key = stages.computation, name
        self.seconds[key] = self.seconds.get(key, 0.0) + seconds
        if number == 0 and name == next(filter(stages.count_entries, stages.names)):
            for one in stages.names:
                key = stages.computation, one
                self.planned[key] = self.planned.get(key, 0.0) + stages.count_entries(one)

    def compute_means(self) -> dict[str, dict[str, float]]:
        """Compute the expected seconds of each planned entry; some runs may have skipped it."""
        means: dict[str, dict[str, float]] = {}
        for (computation, name), seconds in self.seconds.items():
            count = self.planned.get((computation, name), 0.0)
            means.setdefault(computation, {})[name] = seconds / count if count else seconds
        return means


@contextmanager
def record_stages() -> Iterator[StageClock]:
    """Measure the CPU time of all stages that are entered inside the block."""
    clock, plain = StageClock(), TimedStages.enter

    @contextmanager
    def enter(stages: TimedStages, name: str, text: str = "", number: int = 0) -> Iterator[None]:
        began = process_time()
        try:
            with plain(stages, name, text, number):
                yield
        finally:
            clock.add(stages, name, number, process_time() - began)

    with patch.object(TimedStages, "enter", enter):
        yield clock
