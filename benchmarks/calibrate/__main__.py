# SPDX-License-Identifier: MIT
"""Calibration of the stated shift by several optimisers at equal CPU time.

    python -m benchmarks.calibrate [SEED] [--policy NAME] [--alone] [--against NAME]

Optuna takes part where it is installed; it is no dependency of the project.

Prints one row per optimiser, over 4,000 fresh draws that none of them has seen, and whether the
stated bounds hold: 95 % of the lock-ups by 1.15 s, mean friction energy at most 46 kJ, peak jerk
below 20 Hz and vibration dose no larger than of the hand tuning, at most 60 s of CPU time with all
starts. Peak jerk with knots or the controller's parameters: 95 % at most 50 m/s^3, 99 % at most
60. With the closed slip loop behind actuators: 95 % at most 32 and 99.5 % at most 45, and no unit
locks twice. Without --policy all run.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.calibrate.optimizers import (
    Entry,
    run_cma,
    run_lbfgs,
    run_optuna,
    run_product,
    run_start,
)
from benchmarks.calibrate.statement import (
    CERTIFICATE_SEED,
    CPU,
    ENERGY,
    FRESH,
    LOCK_BY,
    REQUEST,
    make_controller_task,
    make_slip_task,
    make_task,
)
from drivetwin.calibration.calibrate import Task
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import CalibrationSettings, compute_tail_mean
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.scenarios import Purpose, draw_scenarios

TAIL = 0.9
"""Quantile beyond which the objective averages peak jerk."""
_HEAD = (
    *("optimiser", "CPU [s]", "shifts", "objective", "peak jerk 95 %", "99 %", "99.5 %", "worst"),
    *("20 Hz 95 %", "dose 95 %", "lock 95 % [s]", "energy [kJ]", "second slips"),
)


@dataclass(frozen=True)
class Problem:
    """A problem: its task, and bounds of peak jerk by quantile."""

    make: Callable[[CalibrationSettings, int], Task]
    jerk: Mapping[float, float]
    locks_once: bool


_PROBLEMS = {
    PolicyKind.KNOTS: Problem(make_task, {0.95: 50.0, 0.99: 60.0}, locks_once=False),
    PolicyKind.CONTROLLER: Problem(
        make_controller_task, {0.95: 50.0, 0.99: 60.0}, locks_once=False
    ),
    PolicyKind.SLIP: Problem(make_slip_task, {0.95: 32.0, 0.995: 45.0}, locks_once=True),
}


_OTHERS = {"cma": run_cma, "lbfgs": run_lbfgs, "optuna": run_optuna}
"""Other optimisers by name."""


def format_row(one: Entry) -> str:
    """Row of the table."""
    found = one.found.certificate
    jerk = found.quantiles[Metric.PEAK_JERK]
    cells = (
        one.name,
        f"{one.cpu:.1f}",
        f"{one.runs}",
        f"{compute_tail_mean(one.found.outcome.values[Metric.PEAK_JERK], TAIL):.1f}",
        f"{jerk.share_95:.1f}",
        f"{jerk.share_99:.1f}",
        f"{np.quantile(one.found.outcome.values[Metric.PEAK_JERK], 0.995):.1f}",
        f"{jerk.worst:.1f}",
        f"{found.quantiles[Metric.SMOOTH_JERK].share_95:.1f}",
        f"{found.quantiles[Metric.VIBRATION_DOSE].share_95:.3f}",
        f"{found.quantiles[Metric.SHIFT_TIME].share_95 + REQUEST:.3f}",
        f"{found.quantiles[Metric.FRICTION_ENERGY].mean / 1e3:.1f}",
        f"{found.relocked}",
    )
    return f"| {' | '.join(cells)} |"


def list_failures(one: Entry, start: Entry, problem: Problem) -> list[str]:
    """Return the stated bounds that a calibration misses; some are values of the hand tuning."""
    found, tuned = one.found.certificate, start.found.certificate
    values = one.found.outcome.values[Metric.PEAK_JERK]
    checks = {
        f"peak jerk, {100.0 * share:g} %": float(np.quantile(values, share)) <= bound
        for share, bound in problem.jerk.items()
    }
    checks |= {
        f"{metric} of the hand tuning": found.quantiles[metric].share_95
        <= tuned.quantiles[metric].share_95
        for metric in (Metric.SMOOTH_JERK, Metric.VIBRATION_DOSE)
    }
    checks |= {
        "lock-up, 95 %": found.quantiles[Metric.SHIFT_TIME].share_95 <= LOCK_BY - REQUEST,
        "mean energy": found.quantiles[Metric.FRICTION_ENERGY].mean <= ENERGY,
        "CPU time": one.cpu <= CPU,
    }
    if problem.locks_once:
        checks["one lock-up each"] = found.relocked == found.unlocked == 0
    return [name for name, holds in checks.items() if not holds]


def solve(kind: PolicyKind, given: argparse.Namespace) -> list[str]:
    """Run all optimisers on a problem and print the table; return the bounds that are missed."""
    problem, usual = _PROBLEMS[kind], CalibrationSettings()
    settings = replace(usual, threads=1, certificate_draws=FRESH)
    task = problem.make(settings, given.seed)
    fresh = draw_scenarios(task.maneuver, task.draw, FRESH, CERTIFICATE_SEED, Purpose.CERTIFICATE)
    sys.stdout.write(f"| {' | '.join(_HEAD)} |\n|{'---|' * len(_HEAD)}\n")
    start = run_start(task, fresh)
    sys.stdout.write(format_row(start) + "\n")
    product = run_product(task, fresh, CPU)
    sys.stdout.write(format_row(product) + "\n")
    sys.stdout.flush()
    for name in () if given.alone else given.against or _OTHERS:
        run = _OTHERS[name]
        one = run(task, fresh, product.cpu)
        absent = "| Optuna | not installed: pip install optuna |"
        sys.stdout.write((absent if one is None else format_row(one)) + "\n")
        sys.stdout.flush()
    missed = list_failures(product, start, problem)
    sys.stdout.write(f"missed: {', '.join(missed)}\n" if missed else "all bounds hold\n")
    return missed


def main() -> int:
    """Run all optimisers; 1 where the product misses a bound."""
    parser = argparse.ArgumentParser()
    parser.add_argument("seed", type=int, nargs="?", default=1)
    parser.add_argument("--policy", type=PolicyKind, choices=list(_PROBLEMS))
    parser.add_argument("--against", action="append", choices=list(_OTHERS))
    parser.add_argument("--alone", action="store_true", help="without the other optimisers")
    given = parser.parse_args()
    chosen = _PROBLEMS if given.policy is None else (given.policy,)
    missed = []
    for kind in chosen:
        sys.stdout.write(f"{kind}\n")
        missed += solve(kind, given)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
