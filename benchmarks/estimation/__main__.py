# SPDX-License-Identifier: MIT
"""`python -m benchmarks.estimation`: run the studies and write docs/accuracy.md after each."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.estimation.bench import Knowledge
from benchmarks.estimation.mismatch import FAULTS, shift_of
from benchmarks.estimation.report import Page, text_of
from benchmarks.estimation.starts import count_outcomes
from benchmarks.estimation.study import run_study
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenarios import SCENARIOS

PAGE = Path(__file__).parents[2] / "docs" / "accuracy.md"
COUNT, TRIES, FAULTY = 200, 200, 20
"""Realisations of a case, tries of bad starts, realisations of a fault: a shift of the mean needs
few."""
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


def main() -> int:
    """Run all cases with as many realisations as asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="realisations of a case")
    parser.add_argument("--tries", type=int, default=TRIES, help="fits from bad start values")
    parser.add_argument("--faulty", type=int, default=FAULTY, help="realisations of a fault")
    asked = parser.parse_args()
    made = Page()
    for place, (name, know, text) in enumerate(CASES):
        seeds = range(place * asked.count, (place + 1) * asked.count)
        made = made.with_study(run_study(SCENARIOS[name](), know, seeds), text)
        _write(made, f"{name}, {text}")
    made = made.with_outcomes(count_outcomes(asked.tries))
    _write(made, f"{asked.tries} bad starts")
    for fault in FAULTS:
        made = made.with_shift(shift_of(fault, asked.faulty), asked.faulty)
        _write(made, fault.text)
    return 0


def _write(made: Page, done: str) -> None:
    """Bring the page up to what is done."""
    PAGE.write_text(text_of(made), encoding="utf-8")
    print(f"{done}: done", flush=True)


if __name__ == "__main__":
    sys.exit(main())
