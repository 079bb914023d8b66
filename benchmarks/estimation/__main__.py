# SPDX-License-Identifier: MIT
"""`python -m benchmarks.estimation [COUNT]`: run the studies and write docs/accuracy.md."""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.estimation.bench import Knowledge
from benchmarks.estimation.mismatch import FAULTS, shift_of
from benchmarks.estimation.report import page
from benchmarks.estimation.study import run_study
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenarios import SCENARIOS

PAGE = Path(__file__).parents[2] / "docs" / "accuracy.md"
COUNT = 200
SHARE = 10
"""One realisation of each fault for so many of a study: a shift of the mean needs few."""
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
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    few = max(2, count // SHARE)
    studies = []
    for name, know, text in CASES:
        studies.append((run_study(SCENARIOS[name](), know, count), text))
        print(f"{name}, {text}: done", flush=True)
    shifts = []
    for fault in FAULTS:
        shifts.append(shift_of(fault, few))
        print(f"{fault.text}: done", flush=True)
    PAGE.write_text(page(studies, shifts, (count, few)), encoding="utf-8")
    print(f"wrote {PAGE.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
