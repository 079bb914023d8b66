# SPDX-License-Identifier: MIT
"""Polish on a problem with a closed form, jerk linear in the coordinates, and on a shift."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import linprog

from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Objective, compute_tail_mean
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.knots import build_knot_policy
from drivetwin.calibration.policy import Space
from drivetwin.calibration.polish import Linear, assemble_program, polish
from tests.calibration.cases import SYSTEM, build_profiles, make_draws, make_plant, make_upshift
from tests.support.arrays import FloatArray

DRAWS = np.linspace(-1.0, 1.0, 20)


def _run(candidates: Sequence[FloatArray]) -> list[Outcome]:
    return [_run_one(at) for at in candidates]


def _run_one(at: FloatArray) -> Outcome:
    """Peak jerk |40·(x - 0.6) + 4·draw| + 5, shift time 1 - y, which x + y moves no further."""
    peak = 40.0 * (at[0] - 0.6) + 4.0 * DRAWS
    jerk = np.zeros((DRAWS.size, 21))
    jerk[:, 5] = peak
    jerk[:, 15] = -5.0 - 10.0 * at[1]
    no = np.zeros(DRAWS.size, dtype=np.bool_)
    values = {
        Metric.PEAK_JERK: np.abs(jerk).max(axis=1),
        Metric.SHIFT_TIME: np.full(DRAWS.size, 1.0 - at[1]),
    }
    return Outcome(values, jerk, no, no)


def test_reaches_the_minimum_without_limits() -> None:
    objective = Objective((), 0.9, 1.0)
    found = polish(_run, np.array([0.2, 0.4]), objective, 40)
    assert found.value == pytest.approx(5.0, abs=0.2)


def test_keeps_a_limit_that_costs_comfort() -> None:
    objective = Objective((Limit(Metric.SHIFT_TIME, 0.5),), 0.9, 1000.0)
    found = polish(_run, np.array([0.5, 0.1]), objective, 40)
    assert found.coordinates[1] == pytest.approx(0.5, abs=2e-3)
    assert found.value == pytest.approx(10.0, abs=0.3)


def test_never_returns_worse_than_the_start() -> None:
    objective = Objective((), 0.9, 1.0)
    start = np.array([0.61, 0.0])
    assert polish(_run, start, objective, 3).value <= objective.evaluate(_run_one(start))


def test_follows_a_shift_whose_events_change_their_order() -> None:
    shift = make_upshift()
    hand = build_controller_policy(shift, SYSTEM)
    policy = build_knot_policy(shift, build_profiles(Space(hand), Space(hand).start), SYSTEM)
    space, plant, draws = Space(policy), make_plant(shift), make_draws(shift, 16)

    def run(candidates: Sequence[FloatArray]) -> list[Outcome]:
        return plant.evaluate_all([space.build_control(one) for one in candidates], draws)

    objective = Objective((Limit(Metric.SHIFT_TIME, 0.75),), 0.9, 2000.0)
    start = objective.evaluate(run([space.start])[0])
    assert polish(run, space.start, objective, 12).value < 0.22 * start


def test_program_with_few_rows_has_the_minimum_of_all_rows() -> None:
    random = np.random.default_rng(3)
    for scenarios, rows, q in ((6, 90, 3), (40, 400, 5)):
        owner = np.sort(
            np.concatenate([np.arange(scenarios), random.integers(0, scenarios, rows - scenarios)])
        )
        jerk = Linear(random.uniform(5.0, 50.0, rows), random.normal(0.0, 90.0, (rows, q)), owner)
        limit = Linear(
            random.normal(0.0, 0.1, scenarios),
            random.normal(0.0, 2.0, (scenarios, q)),
            np.arange(scenarios),
        )
        objective = Objective((Limit(Metric.SHIFT_TIME, 1.0),), 0.9, 500.0)
        at = random.uniform(0.0, 1.0, q)
        program = assemble_program(at, objective, jerk, [limit], scenarios)
        for radius in (0.25, 0.03, 0.003):
            box = list(zip(np.maximum(-radius, -at), np.minimum(radius, 1.0 - at), strict=True))
            slack = [(0.0, None)] * (program.cost.size - q - 1)
            whole = linprog(
                program.cost,
                program.matrix.toarray(),
                program.bound,
                bounds=[*box, (None, None), *slack],
            )
            found = program.solve(radius) - at
            sizes = jerk.value + jerk.slope @ found
            peaks = np.array([sizes[owner == one].max() for one in range(scenarios)])
            excess = np.maximum(limit.value + limit.slope @ found, 0.0).mean()
            value = compute_tail_mean(peaks, 0.9) + 500.0 * excess
            assert value == pytest.approx(whole.fun, rel=1e-5)
