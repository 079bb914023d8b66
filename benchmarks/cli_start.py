# SPDX-License-Identifier: MIT
"""How long `drivetwin --help` takes, import included; fails above 0.3 s.

Run with `python benchmarks/cli_start.py` in the environment of the program.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

LIMIT = 0.3
RUNS = 11


def seconds_of(*arguments: str) -> float:
    """Wall time of one run of the program [s]."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "drivetwin", *arguments], check=True, capture_output=True)
    return time.perf_counter() - start


def main() -> int:
    """Print the median of several runs; 1 if it is above the limit."""
    median = statistics.median(seconds_of("--help") for _ in range(RUNS))
    print(f"drivetwin --help: median {median:.3f} s of {RUNS} runs, limit {LIMIT} s")
    return int(median > LIMIT)


if __name__ == "__main__":
    sys.exit(main())
