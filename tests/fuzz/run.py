# SPDX-License-Identifier: MIT
"""Thousands of damaged files through every reader: `python -m tests.fuzz.run --count 20000`.

Each must end as a log or a typed error within 10 s and 1 GB. The files are read in a process of
their own, so that a crash is a finding and not an end.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path

from drivetwin.errors import DrivetwinError
from drivetwin.logs.read import read_log, read_raw
from tests.fuzz.mutate import mutate
from tests.fuzz.seeds import SEEDS
from tests.logs.made import card

LONGEST = 10.0
"""Seconds for one file."""

MOST_MEMORY = 1_000_000_000
"""Bytes that one file may add."""


@dataclass
class Tally:
    """Outcomes of one format, and the seeds that should not have ended as they did."""

    outcomes: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0


def outcome(path: Path, folder: Path) -> str:
    """Read one file in both ways; the name of what happened. Any other exception passes through."""
    try:
        read_raw(path)
    except DrivetwinError as refusal:
        return type(refusal).__name__
    try:
        log = read_log(path, card(folder))
    except DrivetwinError as refusal:
        return f"columns, then {type(refusal).__name__}"
    return "log with warnings" if log.warnings else "log"


def fuzz(name: str, count: int, first: int = 0) -> Tally:
    """Read `count` damaged files of one format in other processes."""
    tally = Tally()
    seed = first
    while seed < first + count:
        here, there = multiprocessing.Pipe(duplex=False)
        worker = multiprocessing.Process(target=_work, args=(there, name, seed, first + count))
        worker.start()
        there.close()
        seed = _follow(here, worker, tally, seed)
    return tally


def _follow(here: Connection, worker: multiprocessing.Process, tally: Tally, seed: int) -> int:
    """Collect outcomes until the worker ends or hangs; the seed to go on with."""
    while True:
        if not here.poll(4 * LONGEST):
            worker.kill()
            tally.faults.append((seed, f"no answer within {4 * LONGEST:g} s"))
            return seed + 1
        try:
            what, seconds, fault = here.recv()
        except EOFError:
            worker.join()
            if worker.exitcode:
                tally.faults.append((seed, f"the process died: {worker.exitcode}"))
                return seed + 1
            return seed
        tally.outcomes[what] += 1
        tally.slowest = max(tally.slowest, seconds)
        if fault:
            tally.faults.append((seed, fault))
        seed += 1


def _work(there: Connection, name: str, first: int, end: int) -> None:
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        whole = SEEDS[name](folder)
        path = folder / "damaged.log"
        path.write_bytes(whole)
        assert outcome(path, folder) in ("log", "log with warnings"), name
        before = _memory()
        resource.setrlimit(resource.RLIMIT_DATA, (before + 3 * MOST_MEMORY, resource.RLIM_INFINITY))
        for seed in range(first, end):
            path.write_bytes(mutate(whole, seed))
            started, fault = time.monotonic(), ""
            try:
                what = outcome(path, folder)
            except BaseException:  # everything that is no DrivetwinError is what is looked for
                what, fault = "untyped", traceback.format_exc()
            seconds, more = time.monotonic() - started, _memory() - before
            if seconds > LONGEST or more > MOST_MEMORY:
                fault += f"took {seconds:.1f} s and {more / 1e6:.0f} MB"
            before = max(before, _memory()) if more > MOST_MEMORY else before
            there.send((what, seconds, fault))
    there.close()


def _memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main() -> int:
    """Fuzz the formats named, all by default; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("formats", nargs="*", default=[], metavar="FORMAT")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    bad = 0
    for name in options.formats or SEEDS:
        tally = fuzz(name, options.count, options.first)
        bad += len(tally.faults)
        shown = ", ".join(f"{what} {count}" for what, count in tally.outcomes.most_common())
        print(f"{name}: {shown}; slowest {tally.slowest:.2f} s; {len(tally.faults)} faults")
        for seed, fault in tally.faults[:5]:
            print(f"  seed {seed}:\n{fault}")
    return 1 if bad else 0


if __name__ == "__main__":
    multiprocessing.set_start_method("forkserver")
    sys.exit(main())
