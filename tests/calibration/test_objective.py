# SPDX-License-Identifier: MIT
"""Objective: tail mean and exact penalties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Objective, Statistic, compute_tail_mean
from drivetwin.errors import InputError

VALUES = st.lists(st.floats(0.0, 1e3), min_size=1, max_size=40)


@given(VALUES, st.floats(0.0, 0.99))
def test_tail_mean_lies_between_mean_and_maximum(values: list[float], share: float) -> None:
    array = np.array(values)
    found = compute_tail_mean(array, share)
    assert array.mean() - 1e-9 <= found <= array.max() + 1e-9


def test_tail_mean_of_a_tenth() -> None:
    assert compute_tail_mean(np.arange(20.0), 0.9) == 18.5


def _outcome(jerk: list[float], time: list[float]) -> Outcome:
    no = np.zeros(len(jerk), dtype=np.bool_)
    values = {Metric.PEAK_JERK: np.array(jerk), Metric.SHIFT_TIME: np.array(time)}
    return Outcome(values, np.zeros((len(jerk), 3)), no, no)


def test_penalty_is_relative_to_the_bound() -> None:
    outcome = _outcome([10.0, 20.0], [0.6, 0.9])
    each = Objective((Limit(Metric.SHIFT_TIME, 0.6),), 0.5, 100.0)
    assert each.evaluate(outcome) == pytest.approx(20.0 + 100.0 * 0.25)
    mean = Objective((Limit(Metric.SHIFT_TIME, 0.75, Statistic.MEAN),), 0.5, 100.0)
    assert mean.evaluate(outcome) == pytest.approx(20.0)
    assert mean.tighten([0.2]).evaluate(outcome) == pytest.approx(20.0 + 100.0 * 0.25)


def test_units_that_slip_again_are_penalised_by_their_share() -> None:
    outcome = _outcome([10.0, 20.0], [0.6, 0.9])
    again = replace(outcome, relocked=np.array([True, False]))
    objective = Objective((), 0.5, 100.0)
    assert objective.evaluate(again) == pytest.approx(objective.evaluate(outcome) + 50.0)


@pytest.mark.parametrize("bound", [0.0, -1.0, float("nan"), float("inf")])
def test_a_bound_is_positive(bound: float) -> None:
    with pytest.raises(InputError, match="shift_time"):
        Limit(Metric.SHIFT_TIME, bound)
