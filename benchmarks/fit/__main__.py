# SPDX-License-Identifier: MIT
"""Accuracy and cost of `Model.fit` on nine drivelines.

    python -m benchmarks.fit [--problem NAME] [--count N] [--seed SEED] [--workers N]
                             [--rate HZ] [--mismatch] [--rows FILE] [--write] [--bounds] [--peers]
                             [--coupled] [--paper]

Each realisation has noise on outputs and measured inputs, and priors of 30 % whose means are drawn
about the truth; the search starts at these means. A minimum is right if its cost is at most 10
above that of the fit that starts at the truth. The bound is that of Cramér and Rao with priors and
unknown start values. With `--mismatch` the errors of all numbers that are no unknowns are drawn
from their usual distributions; else these numbers are exact. `--peers` compares other programs on
three realisations of each problem, `--coupled` fits the published CoupledClutches of the Modelica
Standard Library, `--paper` compares with the likelihood fit of `identify`.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from benchmarks.code_version import read_commit
from benchmarks.fit.bound import compute_bound, format_bound
from benchmarks.fit.problems import PROBLEMS, build_problem
from benchmarks.raw_results import add_options, finish_study

COUNT, SEED = 200, 9000
"""Realisations of each problem, and the seed of the first one."""


def main() -> int:
    """Run what is asked for; each section appears when it is done."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--problem", nargs="+", choices=PROBLEMS, default=list(PROBLEMS))
    parser.add_argument("--count", type=int, default=COUNT, help="realisations of each problem")
    parser.add_argument("--seed", type=int, default=SEED, help="seed of the first realisation")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument(
        "--estimate-noise", action="store_true", help="do not state the noise of the outputs"
    )
    parser.add_argument(
        "--mismatch", action="store_true", help="draw the errors of all fixed numbers"
    )
    parser.add_argument("--rate", type=float, help="rate of noisier and rounded channels [Hz]")
    parser.add_argument("--bounds", action="store_true", help="bounds alone, without fits")
    parser.add_argument("--peers", action="store_true", help="compare other programs")
    parser.add_argument("--coupled", action="store_true", help="CoupledClutches alone")
    parser.add_argument("--paper", action="store_true", help="shift of the paper alone")
    add_options(parser)
    given = parser.parse_args()
    _print(f"Code of commit {read_commit()}.\n")
    if given.bounds:
        for name in given.problem:
            problem = build_problem(name)
            _print(format_bound(problem, compute_bound(problem)))
    elif given.peers:
        from benchmarks.fit.peers import compare

        for name in given.problem:
            for line in compare(name, given.seed):
                _print(line)
    elif given.coupled:
        from benchmarks.fit.coupled_clutches import run

        _print(run(given.seed))
    elif given.paper:
        from benchmarks.fit.paper_shift import run as run_paper

        _print(run_paper(given.seed))
    else:
        _run_study(given)
    return 0


def _run_study(given: argparse.Namespace) -> None:
    from benchmarks.fit.study import list_tables, run_study

    tables: dict[str, list[dict[str, Any]]] = {"logs": [], "values": []}
    seeds = range(given.seed, given.seed + given.count)
    for name in given.problem:
        tries = run_study(
            name,
            seeds,
            given.workers,
            sigmas_known=not given.estimate_noise,
            mismatch=given.mismatch,
            rate=given.rate,
            rows=given.rows,
        )
        bound = {} if given.mismatch else compute_bound(build_problem(name, given.rate)).std
        for table, rows in list_tables(name, tries, bound).items():
            tables[table] += rows
    command = f"benchmarks.fit --count {given.count} --seed {given.seed}"
    command += f" --problem {' '.join(map(repr, given.problem))}" * (
        given.problem != list(PROBLEMS)
    )
    command += f" --rate {given.rate:g}" if given.rate else ""
    command += " --mismatch" * given.mismatch + " --estimate-noise" * given.estimate_noise
    finish_study("fit-mismatch" if given.mismatch else "fit", command, seeds, tables, given)


def _print(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
