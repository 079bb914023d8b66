# SPDX-License-Identifier: MIT
"""Decimation keeps every extreme and invents no point."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.report.figures.stack import MAX_POINTS, decimate_around, extract_envelope


@settings(max_examples=30)
@given(size=st.integers(1, 3000), limit=st.integers(8, 400), seed=st.integers(0, 99))
def test_envelope_is_a_subset_with_all_extremes(size: int, limit: int, seed: int) -> None:
    time = np.arange(size, dtype=float)
    values = np.random.default_rng(seed).standard_normal(size)
    kept_time, kept = extract_envelope(time, values, limit)
    assert kept_time.size <= max(limit, 8)
    assert np.all(np.diff(kept_time) > 0)
    assert np.array_equal(values[kept_time.astype(int)], kept)
    assert (kept.min(), kept.max()) == (values.min(), values.max())
    assert (kept_time[0], kept_time[-1]) == (0.0, size - 1.0)


def test_spike_between_gaps_survives() -> None:
    time = np.arange(50_000, dtype=float)
    values = np.full(time.size, np.nan)
    values[20_000:30_000] = 0.0
    values[25_123] = 9.0
    kept_time, kept = extract_envelope(time, values)
    assert kept_time[np.nanargmax(kept)] == 25_123.0
    assert np.isnan(kept[0])


def test_focus_keeps_its_samples_where_they_fit() -> None:
    time = np.arange(0.0, 200.0, 1e-3)
    values = np.sin(75.0 * time)
    kept_time, kept = decimate_around(time, values, (100.0, 102.0))
    inside = (time >= 100.0) & (time < 102.0)
    assert np.isin(time[inside], kept_time).all()
    assert kept_time.size <= MAX_POINTS
    assert np.all(np.diff(kept_time) > 0)
    assert kept.max() == values.max()
