# SPDX-License-Identifier: MIT
"""Moving means near the ends of a record."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin._util.signal_processing import compute_moving_mean


@pytest.mark.parametrize("width", [1, 2, 5, 9, 10, 30])
@pytest.mark.parametrize("size", [0, 1, 2, 3, 9, 20])
def test_a_constant_is_kept_up_to_both_ends(width: int, size: int) -> None:
    assert compute_moving_mean(np.full(size, 8e5), width) == pytest.approx(np.full(size, 8e5))


@pytest.mark.parametrize("width", [3, 5, 11, 41])
def test_a_ramp_is_kept_up_to_both_ends(width: int) -> None:
    ramp = np.linspace(-3.0, 7.0, 40)
    assert compute_moving_mean(ramp, width) == pytest.approx(ramp)


@pytest.mark.parametrize("width", [4, 5, 10])
def test_the_mean_is_that_of_the_samples_around(width: int) -> None:
    values = np.random.default_rng(1).normal(size=50)
    mean = compute_moving_mean(values, width)
    around = values[25 - width // 2 : 25 + (width - 1) // 2 + 1]
    assert around.size == width
    assert mean[25] == pytest.approx(around.mean())


def test_an_empty_record_has_an_empty_mean() -> None:
    assert compute_moving_mean(np.empty(0), 5).size == 0
