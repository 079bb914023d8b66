# SPDX-License-Identifier: MIT
"""Largest memory of a process with one batch: `python -m benchmarks.speed.memory KEEP RUNS`."""

from __future__ import annotations

import resource
import sys

from benchmarks.speed.batch import parameter_sets, simulated
from benchmarks.speed.statement import inputs, problem
from drivetwin.batch import Keep


def main() -> None:
    """Print bytes."""
    of = problem()
    keep, runs = Keep(sys.argv[1]), int(sys.argv[2])
    simulated(of, inputs(), parameter_sets(of, runs), (keep, 2))
    print(1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


if __name__ == "__main__":
    main()
