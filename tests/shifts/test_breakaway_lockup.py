# SPDX-License-Identifier: MIT
"""Boundaries from speeds that come every 20 ms, with errors that swing with the shaft."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivetwin.shifts.breakaway_lockup import locate_slip_end, locate_slip_start

STEP = 0.02


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
    left = locate_slip_start(time, (ramp + error)[time < start + duration], noise)
    came = locate_slip_end(time, ramp - sign * change + error, noise)
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
    found = locate_slip_start(time, (ramp + swing)[time < 1.9], 0.2)
    assert found is not None
    assert found.time == pytest.approx(1.52, abs=0.03)


@given(
    start=st.floats(1.0, 1.02),
    duration=st.floats(0.3, 1.0),
    change=st.floats(20.0, 60.0),
    power=st.floats(1.0, 2.0),
    seed=st.integers(0, 1000),
)
def test_the_uncertainty_of_a_beginning_holds_a_soft_onset(
    start: float, duration: float, change: float, power: float, seed: int
) -> None:
    time = np.arange(0.0, 3.0, STEP)
    slip = change * np.clip((time - start) / duration, 0.0, 1.0) ** power
    error = 0.1 * np.random.default_rng(seed).normal(size=time.size)
    found = locate_slip_start(time, (slip + error)[time < start + duration], 0.1)
    assert found is not None
    assert abs(found.time - start) < 3.0 * found.sigma


def test_one_sample_that_swings_after_lock_up_moves_it_little() -> None:
    time = np.arange(0.0, 2.0, STEP)
    slip = -40.0 * np.clip((1.2 - time) / 0.4, 0.0, 1.0)
    swinging = slip.copy()
    swinging[62] = 0.8
    found = [locate_slip_end(time, one, 0.15) for one in (slip, swinging)]
    assert found[0] is not None
    assert found[1] is not None
    assert found[0].time == pytest.approx(1.2, abs=STEP)
    assert found[1].time == pytest.approx(1.2, abs=STEP)


@given(
    start=st.floats(1.0, 1.02),
    flare=st.floats(3.0, 10.0),
    duration=st.floats(0.2, 0.4),
    pace=st.floats(60.0, 120.0),
    seed=st.integers(0, 1000),
)
def test_a_slip_that_turns_after_a_flare_began_with_the_flare(
    start: float, flare: float, duration: float, pace: float, seed: int
) -> None:
    time = np.arange(0.0, 3.0, STEP)
    rise = flare * np.sin(0.5 * np.pi * np.clip((time - start) / duration, 0.0, 1.0))
    slip = rise - pace * np.clip(time - start - duration, 0.0, None)
    error = 0.2 * np.random.default_rng(seed).normal(size=time.size)
    end = start + duration + (40.0 + flare) / pace
    found = locate_slip_start(time, (slip + error)[time < end], 0.2)
    assert found is not None
    assert found.time < start + duration
    assert abs(found.time - start) < 3.0 * found.sigma


@given(
    slip=st.lists(st.floats(-50.0, 50.0), min_size=4, max_size=20),
    noise=st.floats(0.01, 10.0),
)
@example(slip=[0.9, 1.1, -1.2, 1.3, 1.2, -1.4], noise=0.25)
def test_whatever_the_slip_a_boundary_is_told_within_it_or_none(
    slip: list[float], noise: float
) -> None:
    time = np.linspace(0.0, STEP * (len(slip) - 1), len(slip))
    for find in (locate_slip_start, locate_slip_end):
        found = find(time, np.array(slip), noise)
        if found is not None:
            assert 0.0 <= found.time <= time[-1] + STEP or find is locate_slip_end
            assert found.sigma > 0.0
