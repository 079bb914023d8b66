# SPDX-License-Identifier: MIT
"""Calibration of the stated shift by several optimisers at equal CPU time.

    python -m benchmarks.calibrate [SEED] [--starts N] [--evaluations N]

Prints one row per optimiser, over 4,000 fresh draws that none of them has seen, and whether the
stated bounds hold: 95 % of peak jerk at most 50 m/s^3 and 99 % at most 60, 95 % of the lock-ups by
1.15 s, mean friction energy at most 46 kJ, at most 60 s of CPU time with all starts.
"""

from __future__ import annotations

import argparse
import sys

from benchmarks.calibrate.optimizers import Entry, run_cma, run_lbfgs, run_product, run_start
from benchmarks.calibrate.statement import (
    CERTIFICATE_SEED,
    CPU,
    ENERGY,
    FRESH,
    LOCK_BY,
    REQUEST,
    SHARE_95,
    SHARE_99,
    make_task,
)
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.scenarios import Purpose, draw_scenarios
from drivetwin.calibration.settings import CalibrationSettings

_HEAD = (
    *("optimiser", "CPU [s]", "shifts", "peak jerk 95 %", "99 %", "worst", "20 Hz 95 %"),
    *("dose 95 %", "lock 95 % [s]", "energy [kJ]", "second slips"),
)

_EVALUATIONS = 3600
"""Candidates of each finalist, two and a half times as many as by default: the time allows it."""


def format_row(one: Entry) -> str:
    """Row of the table."""
    found = one.found.certificate
    jerk = found.quantiles[Metric.PEAK_JERK]
    cells = (
        one.name,
        f"{one.cpu:.1f}",
        f"{one.runs}",
        f"{jerk.share_95:.1f}",
        f"{jerk.share_99:.1f}",
        f"{jerk.worst:.1f}",
        f"{found.quantiles[Metric.SMOOTH_JERK].share_95:.1f}",
        f"{found.quantiles[Metric.VIBRATION_DOSE].share_95:.3f}",
        f"{found.quantiles[Metric.SHIFT_TIME].share_95 + REQUEST:.3f}",
        f"{found.quantiles[Metric.FRICTION_ENERGY].mean / 1e3:.1f}",
        f"{found.relocked}",
    )
    return f"| {' | '.join(cells)} |"


def list_failures(one: Entry) -> list[str]:
    """Return the stated bounds that a calibration misses."""
    found = one.found.certificate.quantiles
    checks = {
        "peak jerk, 95 %": found[Metric.PEAK_JERK].share_95 <= SHARE_95,
        "peak jerk, 99 %": found[Metric.PEAK_JERK].share_99 <= SHARE_99,
        "lock-up, 95 %": found[Metric.SHIFT_TIME].share_95 <= LOCK_BY - REQUEST,
        "mean energy": found[Metric.FRICTION_ENERGY].mean <= ENERGY,
        "CPU time": one.cpu <= CPU,
    }
    return [name for name, holds in checks.items() if not holds]


def main() -> int:
    """Run all optimisers; 1 where the product misses a bound."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("--starts", type=int, default=CalibrationSettings.starts)
    parser.add_argument("--evaluations", type=int, default=_EVALUATIONS)
    parser.add_argument("--alone", action="store_true", help="without the other optimisers")
    given = parser.parse_args()
    settings = CalibrationSettings(
        threads=1,
        certificate_draws=FRESH,
        starts=given.starts,
        evaluations=given.evaluations,
    )
    task = make_task(settings, given.seed)
    fresh = draw_scenarios(task.maneuver, task.draw, FRESH, CERTIFICATE_SEED, Purpose.CERTIFICATE)
    sys.stdout.write(f"| {' | '.join(_HEAD)} |\n|{'---|' * len(_HEAD)}\n")
    sys.stdout.write(format_row(run_start(task, fresh)) + "\n")
    product = run_product(task, fresh, CPU)
    sys.stdout.write(format_row(product) + "\n")
    sys.stdout.flush()
    for run in () if given.alone else (run_cma, run_lbfgs):
        sys.stdout.write(format_row(run(task, fresh, product.cpu)) + "\n")
        sys.stdout.flush()
    missed = list_failures(product)
    sys.stdout.write(f"missed: {', '.join(missed)}\n" if missed else "all bounds hold\n")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
