# SPDX-License-Identifier: MIT
"""Errors of the likelihood method over the Cramér-Rao bound: `python -m benchmarks.estimation`.

Fits noise realisations of scenarios of the virtual dynamometer. Design values that the card has
roughly are drawn about the truth. The bound is the Fisher information at the truth with the noise
of outputs and inputs and the priors of the card.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from benchmarks.estimation.study import compute_bounds, fit_seed, list_bounds, list_values
from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from tests.support.bench import Knowledge

ROUGH = Knowledge(J_out=0.1, P0=5e3)
CASES = {
    "throttle steps": (ScenarioName.THROTTLE_STEPS, Knowledge()),
    "throttle steps, rough card": (ScenarioName.THROTTLE_STEPS, ROUGH),
    "paper steps, rough card": (ScenarioName.PAPER_STEPS, ROUGH),
    "constant torque": (ScenarioName.PAPER, Knowledge()),
    "gearbox, rough card": (ScenarioName.GEARBOX, Knowledge(J_out=0.1, P0=5e3, drum=0.03)),
}
"""Scenarios with the knowledge of the card. A rough card has Jo′ ± 10 %, P0 ± 0.05 bar and drums
± 0.03 kg m²."""
APART = 10_000
"""Seeds of one case begin so far behind those of the case before."""


def main() -> int:
    """Fit the realisations that the file of outcomes lacks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=200, help="realisations of a case")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    add_options(parser)
    given = parser.parse_args()
    done = {(one["kind"], one["seed"]): one for one in read_rows(given.rows)}
    tables: dict[str, list[dict[str, Any]]] = {"logs": [], "values": [], "bounds": []}
    seeds = []
    for place, (kind, (name, know)) in enumerate(CASES.items()):
        scenario, first = load_scenario(name), given.first + place * APART
        bounds = compute_bounds(scenario, know)
        tables["bounds"] += list_bounds(kind, scenario, know, bounds)
        for seed in range(first, first + given.count):
            if (kind, seed) not in done:
                done[kind, seed] = {"kind": kind, **fit_seed(scenario, know, seed)}
                append_row(given.rows, done[kind, seed])
            one = done[kind, seed]
            log = {key: value for key, value in one.items() if key != "errors"}
            tables["logs"].append({**log, "right": not one["failure"]})
            tables["values"] += list_values(one, bounds)
            seeds.append(seed)
    command = f"benchmarks.estimation {given.count} --first {given.first}"
    finish_study("cases", command, seeds, tables, given)
    return 0


if __name__ == "__main__":
    sys.exit(main())
