# SPDX-License-Identifier: MIT
"""Accuracy studies, each with a section of docs/accuracy.md: `python -m benchmarks.estimation`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.code_version import read_commit
from benchmarks.estimation.mismatch import FAULTS, measure_shift
from benchmarks.estimation.report import (
    format_faults,
    format_starts,
    format_study,
    format_unseen,
    update_page,
)
from benchmarks.estimation.starts import count_outcomes
from benchmarks.estimation.study import run_study
from benchmarks.estimation.unseen import identify_unseen
from drivetwin._util.atomic import write_text
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from tests.support.bench import Knowledge

PAGE = Path(__file__).parents[2] / "docs" / "accuracy.md"
COUNT, TRIES, FAULTY, VEHICLES = 200, 200, 20, 100
"""Realisations of a case, tries of bad starts, realisations of a fault (a shift of the mean needs
few), vehicles drawn at random."""
ROUGH = Knowledge(J_out=0.1, P0=5e3)
CASES = (
    (ScenarioName.THROTTLE_STEPS, Knowledge(), "Jo′ and P0 known"),
    (ScenarioName.THROTTLE_STEPS, ROUGH, "Jo′ ± 10 %, P0 ± 0.05 bar"),
    (ScenarioName.PAPER_STEPS, ROUGH, "Jo′ ± 10 %, P0 ± 0.05 bar"),
    (ScenarioName.PAPER, Knowledge(), "constant engine torque, Jo′ and P0 known"),
    (
        ScenarioName.GEARBOX,
        Knowledge(J_out=0.1, P0=5e3, drum=0.03),
        "the whole gearbox; Jo′ ± 10 %, P0 ± 0.05 bar, drums ± 0.03 kg m²",
    ),
)


APART = 10_000
"""Seeds of one case begin so far behind those of the case before."""
STARTS, FAULTS_TOO, UNSEEN = "starts", "faults", "vehicles"
PARTS = (*(str(place) for place in range(1, len(CASES) + 1)), STARTS, UNSEEN, FAULTS_TOO)


def main() -> int:
    """Run all that is asked for; each section of the page appears when it is done."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="realisations of a case")
    parser.add_argument("--tries", type=int, default=TRIES, help="fits from bad start values")
    parser.add_argument("--faulty", type=int, default=FAULTY, help="realisations of a fault")
    parser.add_argument("--vehicles", type=int, default=VEHICLES, help="drawn at random")
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=PARTS, help="cases by number, other sections"
    )
    asked = parser.parse_args()
    for place, (name, know, text) in enumerate(CASES):
        if str(place + 1) in asked.only:
            seeds = range(place * APART, place * APART + asked.count)
            _write(format_study(run_study(load_scenario(name), know, seeds), text))
    if STARTS in asked.only:
        _write(format_starts(count_outcomes(asked.tries)))
    if UNSEEN in asked.only:
        _write(format_unseen(identify_unseen(range(asked.vehicles))))
    if FAULTS_TOO in asked.only:
        shifts = [measure_shift(fault, asked.faulty) for fault in FAULTS]
        _write(format_faults(shifts, asked.faulty))
    return 0


def _write(section: str) -> None:
    """Write a section into the page, with the commit of the code."""
    before = PAGE.read_text(encoding="utf-8")
    write_text(PAGE, update_page(before, f"{section}\nCode of commit {read_commit()}.\n"))
    print(f"{section.partition(chr(10))[0]}: written", flush=True)


if __name__ == "__main__":
    sys.exit(main())
