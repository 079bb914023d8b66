# SPDX-License-Identifier: MIT
"""Packed samples: read back to within their noise, equal arrays once, gaps kept."""

from __future__ import annotations

import base64
import gzip

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drivetwin.report.html import GAP, Store
from tests.support.arrays import FloatArray


def unpacked(store: Store) -> list[FloatArray]:
    """The arrays as the page's script reads them."""
    data = gzip.decompress(base64.b64decode(store.encode()))
    found, place = [], 0
    for entry in store.index:
        count, width = entry["count"], entry.get("width", 0)
        part, place = data[place : place + width * count], place + width * count
        if width == 8:
            found.append(np.frombuffer(part, "<f8"))
            continue
        codes = np.arange(count)
        if width:
            codes = np.cumsum(np.frombuffer(part, "<u2"), dtype=np.uint16)
        values = entry["start"] + entry["step"] * codes
        found.append(np.where(codes == GAP, np.nan, values) if width else values)
    return found


@example(np.array([5e-324, 0.0, 0.0, 0.0]))
@given(
    arrays(
        np.float64,
        st.integers(1, 60),
        elements=st.floats(-1e6, 1e6) | st.just(float("nan")),
    )
)
def test_values_come_back_to_within_half_a_step(values: FloatArray) -> None:
    store = Store()
    store.add_values(values)
    (back,) = unpacked(store)
    known = np.isfinite(values)
    assert np.array_equal(np.isfinite(back), known)
    if known.any():
        step = store.index[0]["step"]
        assert np.abs(back - values)[known].max() <= 0.5001 * step + 1e-9 * np.abs(values).max(
            initial=0.0, where=known
        )


def test_an_even_time_base_is_three_numbers() -> None:
    time = np.arange(0.0, 200.0, 1e-3)
    store = Store()
    store.add_time(time)
    assert store.index == [{"count": 200_000, "start": 0.0, "step": pytest.approx(1e-3)}]
    assert np.allclose(unpacked(store)[0], time, atol=1e-9)


def test_an_uneven_time_base_comes_back() -> None:
    time = np.cumsum(np.random.default_rng(2).uniform(0.5e-3, 1.5e-3, 5000))
    store = Store()
    store.add_time(time)
    assert np.abs(unpacked(store)[0] - time).max() < 1e-5


def test_equal_arrays_stand_once() -> None:
    values = np.arange(5.0) ** 2
    store = Store()
    assert store.add_values(values) == store.add_values(values.copy())
    assert len(store.index) == 1


def test_two_hundred_thousand_noisy_samples_stay_small() -> None:
    store = Store()
    time = np.linspace(0.0, 200.0, 200_000)
    store.add_values(np.random.default_rng(1).standard_normal(200_000) + 100.0 * np.sin(time))
    assert len(store.encode()) < 300_000
