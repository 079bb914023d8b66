# SPDX-License-Identifier: MIT
"""Change points: found where they are, and hardly ever where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.fleet.mixed_model.change_points import find_steps
from tests.support.arrays import FloatArray

UNITS, LOGS = 20, 40


def _fleet(seed: int) -> tuple[Any, FloatArray, FloatArray]:
    """Units, readings and values: each unit its own level and drift, noise of 1."""
    draws = np.random.default_rng(seed)
    unit = np.repeat(np.arange(UNITS), LOGS)
    reading = draws.uniform(0.0, 200.0, unit.size)
    level, drift = draws.normal(0.0, 5.0, UNITS), draws.normal(0.0, 0.03, UNITS)
    return unit, reading, level[unit] + drift[unit] * reading + draws.standard_normal(unit.size)


def test_a_step_is_found_with_its_place_and_size() -> None:
    unit, reading, values = _fleet(0)
    values[(unit == 7) & (reading >= 120.0)] += 5.0
    (step,) = find_steps(unit, reading, values, np.ones(unit.size))
    assert step.unit == 7
    assert step.before < 120.0 <= step.after
    assert step.size == pytest.approx(5.0, abs=3.0 * step.std)


def test_two_steps_of_one_unit_are_both_found() -> None:
    unit, reading, values = _fleet(1)
    for place in (60.0, 140.0):
        values[(unit == 3) & (reading >= place)] += 8.0
    steps = find_steps(unit, reading, values, np.ones(unit.size))
    assert [step.unit for step in steps] == [3, 3]
    assert steps[0].before < 60.0 <= steps[0].after
    assert steps[1].before < 140.0 <= steps[1].after


def test_a_fleet_without_changes_has_none() -> None:
    found = [find_steps(*_fleet(seed), np.ones(UNITS * LOGS)) for seed in range(30)]
    assert sum(map(len, found)) <= 2


def test_one_stray_log_is_no_change() -> None:
    unit, reading, values = _fleet(2)
    values[np.flatnonzero(unit == 5)[10]] += 60.0
    assert not find_steps(unit, reading, values, np.ones(unit.size))


def test_too_few_logs_tell_nothing() -> None:
    unit, reading = np.zeros(7, dtype=int), np.arange(7.0)
    assert not find_steps(unit, reading, np.array([0, 0, 0, 9, 9, 9, 9.0]), np.ones(7))
