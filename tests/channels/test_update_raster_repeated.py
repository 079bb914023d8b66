# SPDX-License-Identifier: MIT
"""Values that messages repeat are detected where their stamps jitter and where some are lost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.channels.test_update_raster import STEP, channel, hold, wave


@given(st.integers(0, 1000), st.integers(2, 5), st.floats(0.1, 0.8))
def test_messages_whose_stamps_jitter(seed: int, repeats: int, jitter: float) -> None:
    updates = wave(200, 0.01)
    held = channel(hold(updates, repeats))
    late = jitter * STEP * np.random.default_rng(seed).uniform(0.0, 1.0, held.time.size)
    fresh = replace(held, time=held.time + late).updates
    assert fresh.values.tolist() == updates.tolist()
    assert fresh.time == pytest.approx((held.time + late)[::repeats])


@given(st.integers(0, 1000), st.integers(2, 4), st.floats(0.02, 0.2))
def test_messages_of_which_some_are_lost(seed: int, repeats: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    whole = channel(hold(wave(300, 0.01), repeats))
    keep = rng.random(whole.time.size) > share
    time = (whole.time + 0.05 * STEP * rng.uniform(size=whole.time.size))[keep]
    fresh = replace(whole, time=time, values=whole.values[keep]).updates
    there = set(whole.values[keep].tolist())
    assert len(there & set(fresh.values.tolist())) > 0.9 * len(there)
    assert fresh.time.size < 1.1 * 300  # hardly a repeated value counts as an update


def test_a_pause_of_years_brings_no_update() -> None:
    rng = np.random.default_rng(3)
    held = channel(hold(wave(100, 0.01), 3))
    late = 0.4 * STEP * rng.uniform(size=held.time.size)
    time = held.time + late + np.where(np.arange(held.time.size) < 150, 0.0, 1e9)
    fresh = replace(held, time=time).updates
    assert fresh.values.tolist() == wave(100, 0.01).tolist()


def test_a_coarse_signal_on_uneven_stamps_repeats_nothing() -> None:
    rng = np.random.default_rng(4)
    time = STEP * (np.arange(4000) + 0.4 * rng.uniform(size=4000))
    values = np.round(30.0 * np.sin(np.linspace(0.0, 9.0, 4000)) ** 2)
    assert replace(channel(values), time=time).raster is None


@given(st.integers(0, 1000))
def test_messages_whose_jitter_a_table_of_even_stamps_shows(seed: int) -> None:
    """Every 10 ms in a table of 1 ms, up to 3 ms off: too far for a raster."""
    rng = np.random.default_rng(seed)
    updates = wave(300, 0.01)
    at = 10 * np.arange(300) + np.clip(np.round(rng.normal(0.0, 1.0, 300)), -3, 3)
    at[7], at[8], at[9] = 73, 77, 93
    shown = np.searchsorted(at, np.arange(3000), "right") - 1
    held = channel(updates[np.maximum(shown, 0)])
    fresh = held.updates
    assert abs(fresh.values.size - 300) < 10
    assert set(updates[1:].tolist()) <= set(fresh.values.tolist())
