# SPDX-License-Identifier: MIT
"""Measure the stiff problems by all programs in turns and write docs/stiffness.md.

`python -m benchmarks.stiff [--rounds N] [--no-write]`; with scikit-sundae installed, CVODE too.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import sys
import time
from pathlib import Path

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before NumPy reads it: one core is measured

import numpy as np
import scipy

from benchmarks.stiff.problem import PROBLEMS, Problem
from benchmarks.stiff.programs import Entry, has_sundials, list_entries
from drivetwin.simulation.dual_clutch import FloatArray

PAGE = Path(__file__).resolve().parents[2] / "docs" / "stiffness.md"
_LONG = 5.0
"""Time of a run from which on it is measured once [s]."""
_HEAD = """# Stiff linear drivelines

Written by `python -m benchmarks.stiff`: inertias in a row on spring-dampers (1e5 N·m/rad,
10 N·m·s/rad), 1 s with a torque on the first that is linear between samples at 1 kHz. All programs
run in turns in one run. Times are medians of processor time, so that other work on the machine
counts little; runs of more than 5 s are measured once. Errors are the largest of all speeds at all
samples against the exact motion, a matrix exponential in long double. The integrators get the
exact Jacobian matrix, and the equations as a function in Python, as a user would write them; a
member without mass is eliminated by hand for them. `SciPy expm` is the exponential of the augmented
matrix over one step and a loop over the samples in NumPy: exact for a linear driveline without
events, of which clutches have several.
"""


def main() -> int:
    """Measure, print and write."""
    options = _parse_options()
    parts = [_HEAD, _describe_machine(options.rounds)]
    parts += [_format_problem(problem, options.rounds) for problem in PROBLEMS]
    text = "\n".join(parts)
    print(text)
    if options.write:
        PAGE.write_text(text, encoding="utf-8")
    return 0


def _format_problem(problem: Problem, rounds: int) -> str:
    entries, exact = list_entries(problem), problem.solve_exactly()
    seconds: dict[int, list[float]] = {number: [] for number in range(len(entries))}
    errors = [float("nan")] * len(entries)
    for _ in range(rounds):
        for number, entry in enumerate(entries):
            if max(seconds[number], default=0.0) < _LONG:
                took, errors[number] = _measure(entry, exact)
                seconds[number].append(took)
    lines = [
        f"## {problem.name}\n",
        "| program | setting | median ms | ratio | max error, rad/s |",
        "|---|---|---|---|---|",
    ]
    medians = [statistics.median(seconds[number]) for number in range(len(entries))]
    for entry, median, error in zip(entries, medians, errors, strict=True):
        shown = "failed" if np.isnan(error) else f"{error:.2g}"
        times = f"{1e3 * median:.3g} | {median / medians[0]:.3g}"
        lines.append(f"| {entry.program} | {entry.setting} | {times} | {shown} |")
    return "\n".join(lines) + "\n"


def _measure(entry: Entry, exact: FloatArray) -> tuple[float, float]:
    """Return the processor time [s] of a run and its error [rad/s]; NaN where it failed."""
    begin = time.process_time()
    speeds = entry.run()
    took = time.process_time() - begin
    return took, float("nan") if speeds is None else float(np.abs(speeds - exact).max())


def _describe_machine(rounds: int) -> str:
    programs = (
        f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"
    )
    load = f", load average {os.getloadavg()[1]:.1f}" if hasattr(os, "getloadavg") else ""
    sundials = "" if has_sundials() else " scikit-sundae was not installed, so CVODE is missing."
    return f"Measured in {rounds} rounds: {programs}{load}.{sundials}\n"


def _parse_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3, help="how often to go round all entries")
    parser.add_argument(
        "--no-write", dest="write", action="store_false", help="print, but leave docs as they are"
    )
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
