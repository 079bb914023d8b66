# SPDX-License-Identifier: MIT
"""Runs many cases in a process of their own: a crash is a finding and not an end.

Each case must end within 10 s and 1 GB, without a warning of the interpreter or a failure in the
background: a user would see either as lines of foreign source.
"""

from __future__ import annotations

import multiprocessing
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

from drivetwin.logs.formats.guarded import trust_parsers

LONGEST = 10.0
"""Seconds of CPU time for one case."""

MOST_MEMORY = 1_000_000_000
"""Bytes that one case may add."""

PATIENCE = 30.0
"""A case that has not answered after so many times LONGEST on a busy machine hangs."""

_CRASHES = (-signal.SIGSEGV, -signal.SIGBUS, -signal.SIGABRT)
"""Exit codes of a process whose library has crashed."""

Prepare = Callable[[Path], Callable[[int], str]]
"""Makes, in a folder of its own, the function from a seed to the name of what happened."""


@dataclass
class Tally:
    """Outcomes by name, and the seeds that should not have ended as they did."""

    outcomes: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0

    def __str__(self) -> str:
        shown = ", ".join(f"{what} {count}" for what, count in self.outcomes.most_common())
        lines = [f"{shown}; slowest {self.slowest:.2f} s; {len(self.faults)} faults"]
        lines += [f"  seed {seed}:\n{fault}" for seed, fault in self.faults[:5]]
        return "\n".join(lines)


def run(prepare: Prepare, count: int, first: int = 0, *, may_crash: bool = False) -> Tally:
    """Run the seeds `first` to `first + count` in other processes; `prepare` must be picklable.

    With `may_crash` a signal that ends the process is an outcome: a library of this format crashes
    on damaged files, which drivetwin reads in a child.
    """
    tally = Tally()
    seed = first
    while seed < first + count:
        here, there = multiprocessing.Pipe(duplex=False)
        worker = multiprocessing.Process(target=_work, args=(there, prepare, seed, first + count))
        worker.start()
        there.close()
        seed = _follow(here, worker, tally, seed, may_crash)
    return tally


def _follow(
    here: Connection,
    worker: multiprocessing.Process,
    tally: Tally,
    seed: int,
    may_crash: bool,
) -> int:
    """Collect outcomes until the worker ends or hangs; the seed to go on with."""
    while True:
        if not here.poll(PATIENCE * LONGEST):
            worker.kill()
            tally.faults.append((seed, f"no answer within {PATIENCE * LONGEST:g} s"))
            return seed + 1
        try:
            what, seconds, fault = here.recv()
        except EOFError:
            worker.join()
            if worker.exitcode in _CRASHES and may_crash:
                tally.outcomes["crash of the library"] += 1
                return seed + 1
            if worker.exitcode:
                tally.faults.append((seed, f"the process died: {worker.exitcode}"))
                return seed + 1
            return seed
        tally.outcomes[what] += 1
        tally.slowest = max(tally.slowest, seconds)
        if fault:
            tally.faults.append((seed, fault))
        seed += 1


def _work(there: Connection, prepare: Prepare, first: int, end: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        trust_parsers()  # this process is itself guarded, and a crash is what is looked for
        outcome = prepare(Path(folder))
        before = _memory()
        background: list[str] = []
        sys.unraisablehook = lambda one: background.append(f"in the background: {one.exc_value!r}")
        warnings.simplefilter("error")
        resource.setrlimit(resource.RLIMIT_DATA, (before + 3 * MOST_MEMORY, resource.RLIM_INFINITY))
        for seed in range(first, end):
            started, fault = time.process_time(), ""
            try:
                what = outcome(seed)
            except BaseException:  # everything that is no DrivetwinError is what is looked for
                what, fault = "untyped", traceback.format_exc()
            fault += "\n".join(background)
            background.clear()
            seconds, more = time.process_time() - started, _memory() - before
            if seconds > LONGEST or more > MOST_MEMORY:
                fault += f"took {seconds:.1f} s and {more / 1e6:.0f} MB"
            before = max(before, _memory()) if more > MOST_MEMORY else before
            there.send((what, seconds, fault))
    there.close()


def _memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
