# SPDX-License-Identifier: MIT
"""One value from several shifts: coverage of the interval, contradiction, singular information."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.bus.scatter import ShiftValue, combine, make_estimate
from drivetwin.estimation.result.estimate import Z95, Verdict


def draw(rng: np.random.Generator, tau: float, count: int = 8) -> list[ShiftValue]:
    found = []
    for k in range(count):
        std = rng.uniform(0.5, 2.0, 2)
        value = np.array([3.0, -1.0]) + rng.normal(0.0, tau, 2) + rng.normal(0.0, std)
        found.append(ShiftValue(f"shift {k}", value, np.diag(std**-2)))
    return found


@pytest.mark.parametrize("tau", [0.0, 3.0])
def test_intervals_cover_with_and_without_scatter(tau: float) -> None:
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(100):
        found = combine(draw(rng, tau))
        assert found is not None
        inside += list(np.abs(found.value - [3.0, -1.0]) < Z95 * found.std)
    assert 0.90 < np.mean(inside) < 0.99


def test_equal_shifts_average_to_the_weighted_mean() -> None:
    shifts = [
        ShiftValue("a", np.array([1.0]), np.eye(1)),
        ShiftValue("b", np.array([1.0]), np.eye(1)),
    ]
    found = combine(shifts)
    assert found is not None
    assert found.value == pytest.approx([1.0])
    assert found.tau == pytest.approx([0.0])
    assert found.covariance[0, 0] == pytest.approx(0.5)


def test_a_shift_that_differs_is_named() -> None:
    shifts = draw(np.random.default_rng(2), 0.0)
    shifts.append(ShiftValue("odd", np.array([30.0, -1.0]), np.eye(2)))
    found = combine(shifts)
    assert found is not None
    assert found.contradicting == ("odd",)
    assert found.p_value < 0.01


def test_kinds_that_differ_are_compared_within_themselves() -> None:
    rng = np.random.default_rng(3)
    far = np.array([20.0, 0.0])
    ends = [replace(one, kind="up", label=f"up {one.label}") for one in draw(rng, 0.0)]
    ends += [replace(one, kind="down", value=one.value + far) for one in draw(rng, 0.0, count=4)]
    found = combine(ends)
    assert found is not None
    assert found.p_value < 1e-6
    assert not found.contradicting
    apart = found.groups["down"].value - found.groups["up"].value
    assert apart == pytest.approx([20.0, 0.0], abs=3.0)
    estimate = make_estimate("f_d", "1", 2.0, 0.001, found)
    assert estimate.verdict is Verdict.WEAK
    alike = combine([replace(one, value=np.array([3.0, -1.0])) for one in ends])
    assert alike is not None
    assert not alike.groups


def test_shifts_that_determine_one_direction_each_complete_one_another() -> None:
    rows = (np.array([1.0, 1.0]), np.array([1.0, -1.0]))
    shifts = [
        ShiftValue(str(k), row * (row @ [2.0, 5.0]) / 2.0, np.outer(row, row))
        for k, row in enumerate(rows)
    ]
    found = combine(shifts)
    assert found is not None
    assert found.value == pytest.approx([2.0, 5.0])
    assert combine(shifts[:1]) is None


def test_a_prior_fills_what_no_shift_determines() -> None:
    shift = ShiftValue("a", np.array([2.0, 0.0]), np.diag([1.0, 0.0]))
    found = combine([shift], np.diag([0.0, 4.0]), np.array([0.0, 7.0]))
    assert found is not None
    assert found.value == pytest.approx([2.0, 7.0])
    assert found.covariance[1, 1] == pytest.approx(0.25)
