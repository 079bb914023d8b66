# SPDX-License-Identifier: MIT
"""Run the comparison, print it and write docs/benchmarks.md.

`python -m benchmarks.speed [--rounds N] [--no-build] [--no-write]`
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.speed import c_peer, general, shift
from benchmarks.speed.batch import measure_batches
from benchmarks.speed.core import ROOT, Example
from benchmarks.speed.instructions import format_instructions
from benchmarks.speed.measure import Entry, Measured, measure
from benchmarks.speed.page import format_limits, format_page
from tests.support.upshift import reference
from tests.support.upshift.scenario import Scenario, build_scenario
from tests.support.upshift.statement import Inputs, Problem, make_inputs, make_problem

PAGE = ROOT / "docs" / "benchmarks.md"


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
        extra = {
            "What was set out to be reached": format_limits(measured),
            "Many runs": measure_batches(of, given, folder),
            "Instructions": format_instructions(of, given, example, stated, folder),
            "Growth": general.format_growth(stated, example),
        }
        text = format_page(measured, _find_base(measured), extra)
    _show_progress("")
    print(text)
    if options.write:
        PAGE.write_text(text, encoding="utf-8")
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


def _find_base(measured: list[Measured]) -> Measured | None:
    return next((one for one in measured if one.entry.program == c_peer.PROGRAM), None)


def _parse_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=25, help="how often to go round all entries")
    parser.add_argument(
        "--no-build", dest="build", action="store_false", help="take the example as it is"
    )
    parser.add_argument(
        "--no-write", dest="write", action="store_false", help="print, but leave docs as they are"
    )
    return parser.parse_args()


def _show_progress(text: str) -> None:
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
