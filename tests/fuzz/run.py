# SPDX-License-Identifier: MIT
"""Thousands of damaged files through every reader: `python -m tests.fuzz.run --count 20000`.

Each must end as a log or a typed error.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from drivetwin.errors import DrivetwinError
from drivetwin.logs.read import read_log, read_raw
from tests.fuzz import harness
from tests.fuzz.mutate import mutate
from tests.fuzz.seeds import CRASHING, SEEDS
from tests.logs.fixtures import card


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
    return "log with warnings" if log.findings else "log"


def prepare(name: str, folder: Path) -> Callable[[int], str]:
    """Read a sound file of one format; then damaged ones by seed."""
    whole = SEEDS[name](folder)
    path = folder / "damaged.log"
    path.write_bytes(whole)
    assert outcome(path, folder) in ("log", "log with warnings"), name

    def damaged(seed: int) -> str:
        path.write_bytes(mutate(whole, seed))
        return outcome(path, folder)

    return damaged


def main() -> int:
    """Fuzz the formats named, all by default; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("formats", nargs="*", default=[], metavar="FORMAT")
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    bad = 0
    for name in options.formats or SEEDS:
        may_crash = name in CRASHING
        tally = harness.run(
            partial(prepare, name), options.count, options.first, may_crash=may_crash
        )
        bad += len(tally.faults)
        print(f"{name}: {tally}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    multiprocessing.set_start_method("forkserver")
    sys.exit(main())
