# SPDX-License-Identifier: MIT
"""Stamps that count from far back: one origin, even steps, nothing done to usual ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetwin.logs.origin import describe_origin, find_origin, subtract_origin

STEPS = np.arange(3000)


@pytest.mark.parametrize(
    "starts", [[], [0.0], [9e5, -9e5], [math.nan], [math.inf]], ids=["none", "0", "12 d", "?", "∞"]
)
def test_usual_stamps_stay_as_they_are(starts: list[float]) -> None:
    assert find_origin(starts) == 0.0
    time = np.array([9e5, math.pi])
    assert subtract_origin(time, 0.0) is time
    assert describe_origin(0.0) == ()


def test_the_first_of_all_far_stamps_is_the_origin_of_all() -> None:
    assert find_origin([1.7e9 + 2.0, 1.7e9, 3.0]) == 1.7e9
    assert describe_origin(1.7e9 + 0.25) == ("time counts from the first stamp, 1700000000.25 s",)


@pytest.mark.parametrize(("origin", "step"), [(1763866345.0, 1e-3), (1763866345123.0 * 1e-3, 5e-4)])
def test_steps_come_out_as_even_as_they_were_written(origin: float, step: float) -> None:
    stamps = np.array([float(f"{origin + k * step:.6f}") for k in STEPS])
    assert subtract_origin(stamps, stamps[0]) == pytest.approx(STEPS * step, abs=1e-12)
