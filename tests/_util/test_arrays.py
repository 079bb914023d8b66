# SPDX-License-Identifier: MIT
"""Results that are kept for stamps."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import remember_for_arrays
from tests.support.arrays import FloatArray


def test_a_result_is_kept_as_long_as_all_arrays() -> None:
    """An array in the place of one that is gone is not taken for it."""
    calls: list[float] = []

    @remember_for_arrays
    def add(time: FloatArray, values: FloatArray) -> float:
        calls.append(float(time[0] + values[0]))
        return calls[-1]

    time = np.zeros(5)
    for value in range(50):
        values = np.full(5, float(value))
        assert add(time, values) == add(time, values) == value
        del values
    assert calls == list(range(50))
