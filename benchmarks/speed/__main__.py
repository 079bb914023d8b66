# SPDX-License-Identifier: MIT
"""Run the comparison and write benchmarks/results/speed.json.

`python -m benchmarks.speed [--rounds N] [--no-build]`; `python -m tools.results_page` builds
docs/benchmarks.md from it.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.raw_results import write_results
from benchmarks.speed import c_peer, general, shift
from benchmarks.speed.batch import SEED, measure_batches
from benchmarks.speed.core import Example
from benchmarks.speed.instructions import measure_instructions
from benchmarks.speed.measure import Entry, measure
from tests.support.upshift import reference
from tests.support.upshift.scenario import Scenario, build_scenario
from tests.support.upshift.statement import Inputs, Problem, make_inputs, make_problem

CLOCK = (
    "Programs take turns in each round, of which the shortest run of each is kept: CPU time of the "
    "process, inside Rust the time on the clock. Batches on two threads are timed by the clock on "
    "the wall."
)
FLAGS = " ".join(c_peer.FLAGS)


def main() -> int:
    """Measure and write."""
    options = _parse_options()
    of, given = make_problem(), make_inputs()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _show_progress("building the example of the core")
        example = Example(folder, build=options.build)
        stated = build_scenario(of, given)
        entries = _collect_entries(of, given, example, stated)
        measured = measure(entries, options.rounds, _show_progress)
        _show_progress("batches, instructions, growth")
        found = {
            "entries": [one.collect() for one in measured],
            "gearbox_span": float(general.plan_gearbox_shifts()[general.WHOLE].time[-1]),
            "batch": measure_batches(of, given, folder),
            "instructions": measure_instructions(of, given, example, stated, folder),
            "growth": general.measure_growth(stated, example),
        }
    _show_progress("")
    path = write_results(
        "speed", found, clock=CLOCK, rounds=options.rounds, seeds=(SEED,), flags={"gcc": FLAGS}
    )
    print(path)
    return 0


def _collect_entries(of: Problem, given: Inputs, example: Example, stated: Scenario) -> list[Entry]:
    judge = shift.compare_with(reference.read())
    library = c_peer.load_library(example.folder)
    return [
        *(c_peer.make_entries(of, given, judge, library) if library is not None else ()),
        *shift.make_entries(of, given, judge, example),
        *shift.make_scipy_entries(of, given, judge),
        *general.make_entries(stated, example),
    ]


def _parse_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=25, help="how often to go round all entries")
    parser.add_argument(
        "--no-build", dest="build", action="store_false", help="take the example as it is"
    )
    return parser.parse_args()


def _show_progress(text: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
