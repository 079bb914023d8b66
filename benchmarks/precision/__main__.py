# SPDX-License-Identifier: MIT
"""Measure all peers in turns and write benchmarks/results/precision.json.

`python -m benchmarks.precision [PEER ...] [--rounds N]` prints a line for each entry; with names of
modules of benchmarks/precision/peers only these, and nothing is written. `python -m
tools.results_page` builds docs/work-precision.md from the results.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy reads it: one core is measured

from benchmarks.precision import peers
from benchmarks.precision.chains import measure_chains
from benchmarks.precision.entry import FLAGS, Entry, Problem
from benchmarks.precision.linear import CHAIN, STIFF
from benchmarks.precision.shift import BATCH, RUNS, SHIFT
from benchmarks.raw_results import write_results
from benchmarks.speed.batch import SEED

PROBLEMS: tuple[Problem, ...] = (SHIFT, STIFF, CHAIN, BATCH)
CLOCK = (
    "Peers take turns in each round, and the shortest round counts. CPU time of the process; "
    "inside Rust the clock, the shortest of 100 runs. Compilation of C, Numba, JAX and CasADi code "
    "and precomputed exponentials are no part of it."
)
PACKAGES = ("numpy", "scipy", "numba", "numbalsoda", "jax", "diffrax", "casadi", "scikit-sundae")
_LONG = 0.2
"""Time of a run from which on it is measured once [s]."""
_ENOUGH = 2e-3
"""Time of a run up to which it repeats in a round [s]."""
_BUNDLE, _BUNDLES = 1e-4, 30
"""Time of runs that are timed together [s], and how often they are."""


@dataclass(eq=False)
class Measured:
    """Seconds of an entry by round, and its error."""

    peer: str
    problem: Problem
    entry: Entry
    seconds: list[float] = field(default_factory=list)
    error: float | None = None

    def measure(self) -> None:
        """Run once more, or more often where a run is short."""
        if self.seconds and self.seconds[0] > _LONG:
            return
        took, values = _time(self.entry, 1)
        if not self.seconds:
            self.error = None if values is None else self.problem.rate(values)
            took, _ = _time(self.entry, 1) if took < _LONG else (took, None)
        if self.entry.repeats and took < _ENOUGH:
            # Short runs in bundles, of which the shortest counts, as inside Rust.
            bundle = int(_BUNDLE / max(took, 1e-6)) + 1
            took = min(_time(self.entry, bundle)[0] for _ in range(_BUNDLES))
        self.seconds.append(took)

    def collect(self) -> dict[str, Any]:
        """Collect the raw result."""
        names = {"problem": self.problem.name, "peer": self.peer, "setting": self.entry.setting}
        return {**names, "seconds": self.seconds, "error": self.error}


def _time(entry: Entry, count: int) -> tuple[float, Any]:
    """Return the time of a run [s] and the result of the last."""
    begin = entry.clock()
    for _ in range(count):
        values = entry.run()
    return (entry.clock() - begin) / count, values


def collect_entries(names: list[str]) -> tuple[list[Measured], dict[str, str]]:
    """Return the entries of peers, of all without names, and why others are missing."""
    entries, missing = [], {}
    for name in names or sorted(one.name for one in pkgutil.iter_modules(peers.__path__)):
        try:
            module = importlib.import_module(f"benchmarks.precision.peers.{name}")
            for problem in PROBLEMS:
                listed: Callable[[Problem], list[Entry]] = module.list_entries
                entries += [Measured(module.NAME, problem, one) for one in listed(problem)]
        except ImportError as error:
            missing[name] = f"{error.name} is not installed"
        except (subprocess.CalledProcessError, FileNotFoundError):
            missing[name] = "it cannot be compiled"
    return entries, missing


def main() -> int:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("peers", nargs="*", help="modules of benchmarks/precision/peers")
    parser.add_argument("--rounds", type=int, default=5, help="how often peers take turns")
    options = parser.parse_args()
    entries, missing = collect_entries(options.peers)
    for _ in range(options.rounds):
        for one in entries:
            one.measure()
    for one in entries:
        error = "failed" if one.error is None else f"{one.error:.2g} {one.problem.unit}"
        time = f"{1e3 * min(one.seconds):10.4g} ms"
        print(f"{one.problem.name:6} {time} {error:>14}  {one.peer}, {one.entry.setting}")
    if not options.peers:
        found = {
            "entries": [one.collect() for one in entries],
            "missing": missing,
            "runs": RUNS,
            "chains": measure_chains(options.rounds),
        }
        flags = {"gcc": " ".join(FLAGS)}
        how = {"rounds": options.rounds, "seeds": (SEED,), "flags": flags, "packages": PACKAGES}
        print(write_results("precision", found, clock=CLOCK, **how))
    return 0


if __name__ == "__main__":
    sys.exit(main())
