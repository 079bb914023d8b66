# SPDX-License-Identifier: MIT
"""Boundaries from speeds that come every 20 ms, with errors that swing with the shaft."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.shifts.sparse import begun, ended

STEP = 0.02


@settings(deadline=None)
@given(
    start=st.floats(1.0, 1.02),
    duration=st.floats(0.25, 0.6),
    change=st.floats(20.0, 60.0),
    sign=st.sampled_from([-1.0, 1.0]),
    seed=st.integers(0, 1000),
)
def test_both_ends_of_a_slip_are_within_a_few_samples(
    start: float, duration: float, change: float, sign: float, seed: int
) -> None:
    time = np.arange(0.0, 3.0, STEP)
    noise = 0.2
    ramp = sign * change * np.clip((time - start) / duration, 0.0, 1.0)
    error = noise * np.random.default_rng(seed).normal(size=time.size)
    left = begun(time, (ramp + error)[time < start + duration], noise)
    came = ended(time, ramp - sign * change + error, noise)
    assert left is not None
    assert came is not None
    # A twentieth of the change counts as begun, so the boundary lies that much late at most.
    assert start - STEP < left.time < start + 0.05 * duration + 2.0 * STEP
    assert abs(came.time - start - duration) < 2.0 * STEP
    assert abs(left.time - start) < 4.0 * left.sigma
    assert abs(came.time - start - duration) < 4.0 * came.sigma


def test_small_slip_while_the_gear_is_held_is_no_beginning() -> None:
    time = np.arange(0.0, 2.0, STEP)
    swing = 0.03 * 40.0 * np.sin(2.0 * np.pi * 4.0 * time)
    ramp = -40.0 * np.clip((time - 1.5) / 0.4, 0.0, 1.0)
    found = begun(time, (ramp + swing)[time < 1.9], 0.2)
    assert found is not None
    assert found.time == pytest.approx(1.52, abs=0.03)


def test_a_slip_that_never_moves_or_never_rests_has_no_boundary() -> None:
    time = np.arange(0.0, 1.0, STEP)
    assert ended(time, np.full(time.size, 20.0), 0.2) is None
    assert ended(time, np.zeros(time.size), 0.2) is None
    assert begun(time, np.full(time.size, 20.0), 0.2) is None
