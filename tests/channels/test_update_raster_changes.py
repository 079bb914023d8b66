# SPDX-License-Identifier: MIT
"""Updates of held signals by evidence: rasters of any kind against measured and rounded signals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.channels.test_update_raster import STEP, channel, hold, wave
from tests.support.arrays import FloatArray


def find(time: FloatArray, values: FloatArray) -> Any:
    """Raster of a channel, None if it is not held."""
    return replace(channel(values), time=time).raster


def stamp(count: int) -> FloatArray:
    return np.asarray(np.round(STEP * np.arange(count), 3), dtype=np.float64)


def test_a_message_of_a_second_is_held() -> None:
    values = hold(wave(30, 0.01), 1000)
    found = find(stamp(values.size), values)
    assert found is not None
    assert found.period == pytest.approx(1.0)


def test_updates_are_counted_through_jitter_that_makes_distances_look_like_two() -> None:
    """Of 2000 updates some are 16 rows apart and others 4: each would be miscounted."""
    rng = np.random.default_rng(5)
    at = 10 * np.arange(2000) + np.clip(np.round(rng.normal(0.0, 1.1, 2000)), -4, 4).astype(int)
    assert np.diff(at).max() > 15
    shown = np.searchsorted(at, np.arange(20000), "right") - 1
    values = wave(2000, 0.01)[np.maximum(shown, 0)]
    found = find(stamp(values.size), values)
    assert found is not None
    assert found.period == pytest.approx(0.01, rel=1e-3)


@given(st.integers(0, 10_000), st.floats(0.05, 0.5))
def test_changes_of_rows_by_chance_are_no_updates(seed: int, often: float) -> None:
    rng = np.random.default_rng(seed)
    values = np.cumsum(np.where(rng.random(3000) < often, rng.normal(size=3000), 0.0))
    assert find(stamp(3000), values) is None


@given(st.integers(0, 10_000), st.floats(0.02, 0.3), st.floats(0.0, 0.3))
def test_stairs_of_a_rounded_curve_are_no_updates(seed: int, rate: float, noise: float) -> None:
    rng = np.random.default_rng(seed)
    slope = rate * (1.0 + 0.3 * np.sin(np.linspace(0.0, 20.0, 4000) + rng.uniform(0.0, 6.0)))
    curve = np.cumsum(slope) + noise * rng.normal(size=4000)
    assert find(stamp(4000), np.round(curve)) is None


def test_changes_of_more_than_a_stair_are_measured_by_chance_alone() -> None:
    """A held signal of equal distances is as likely as stairs but for the size of its steps."""
    time = stamp(1000)
    held, stairs = hold(wave(100, 1.0), 10), np.floor(time / 0.01 + 1e-9)
    assert find(time, held) is not None
    assert find(time, stairs) is None
