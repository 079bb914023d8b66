# SPDX-License-Identifier: MIT
"""Largest memory of a process with one batch: `python -m benchmarks.speed.memory KEEP RUNS`."""

from __future__ import annotations

import re
import sys
from pathlib import Path

from benchmarks.speed.batch import parameter_sets, simulated
from benchmarks.speed.statement import inputs, problem
from drivetwin.batch import Keep


def main() -> None:
    """Print bytes."""
    of = problem()
    keep = None if sys.argv[1] == "misfit" else Keep(sys.argv[1])
    runs = int(sys.argv[2])
    simulated(of, inputs(), parameter_sets(of, runs), (keep, 2))
    # What the system reports as the largest memory of a child includes that of its parent.
    status = Path("/proc/self/status").read_text("utf-8")
    (kilobytes,) = re.findall(r"VmHWM:\s*(\d+) kB", status)
    print(1024 * int(kilobytes))


if __name__ == "__main__":
    main()
