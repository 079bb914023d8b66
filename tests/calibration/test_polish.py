# SPDX-License-Identifier: MIT
"""Objective, search, polish, and the repair of limits and of second slips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog

from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Objective, Statistic
from drivetwin.calibration.polish import Linear, assemble_program, keep_limits, polish
from tests.support.arrays import FloatArray

DRAWS = np.linspace(-1.0, 1.0, 20)


def _run(candidates: Sequence[FloatArray], places: NDArray[np.intp] | None = None) -> list[Outcome]:
    whole = [_run_one(at) for at in candidates]
    return whole if places is None else [one.select(places) for one in whole]


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
            tail = np.sort(peaks)[::-1] @ np.clip(0.1 * scenarios - np.arange(scenarios), 0.0, 1.0)
            value = tail / (0.1 * scenarios) + 500.0 * excess
            assert value == pytest.approx(whole.fun, rel=1e-5)


def measure_outcome(jerk: list[float], time: list[float], slips: int = 0) -> Outcome:
    """Outcome of given values; the first `slips` units slip again."""
    again = np.arange(len(jerk)) < slips
    values = {Metric.PEAK_JERK: np.array(jerk), Metric.SHIFT_TIME: np.array(time)}
    return Outcome(values, np.zeros((len(jerk), 3)), np.zeros(len(jerk), np.bool_), again)


def test_penalties_are_relative_to_the_bound_and_by_the_share_of_second_slips() -> None:
    outcome = measure_outcome([10.0, 20.0], [0.6, 0.9])
    each = Objective((Limit(Metric.SHIFT_TIME, 0.6),), 0.5, 100.0)
    assert each.evaluate(outcome) == pytest.approx(20.0 + 100.0 * 0.25)
    mean = Objective((Limit(Metric.SHIFT_TIME, 0.75, Statistic.MEAN),), 0.5, 100.0)
    assert mean.evaluate(outcome) == pytest.approx(20.0)
    assert mean.tighten([0.2]).evaluate(outcome) == pytest.approx(20.0 + 100.0 * 0.25)
    again, free = measure_outcome([10.0, 20.0], [0.6, 0.9], 1), Objective((), 0.5, 100.0)
    assert free.evaluate(again) == pytest.approx(free.evaluate(outcome) + 50.0)
    twenty = measure_outcome([*map(float, range(20))], [0.0] * 20)
    assert Objective((), 0.9, 1.0).evaluate(twenty) == 18.5  # mean of the largest tenth


LIMITS = (Limit(Metric.SHIFT_TIME, 0.7), Limit(Metric.FRICTION_ENERGY, 4e4))
KEPT = Objective(LIMITS, 0.9, 100.0)


def measure(at: FloatArray) -> list[float]:
    """Excess of coordinates that are the values themselves, over the bounds."""
    return [float(value / one.bound - 1.0) for value, one in zip(at, LIMITS, strict=True)]


@given(st.floats(0.0, 0.08))
def test_a_polish_that_always_exceeds_its_bounds_is_led_within_them(beyond: float) -> None:
    def improve(_: FloatArray, under: Objective) -> FloatArray:
        return np.array([(1.0 + beyond) * one.bound for one in under.limits])

    start = np.array([(1.0 + beyond) * one.bound for one in LIMITS])
    assert keep_limits(measure, improve, start, KEPT, 3, 3.0).value <= 1e-12
