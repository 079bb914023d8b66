# SPDX-License-Identifier: MIT
"""Columns that are zero throughout, as those of other logs."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.optimize.objective import (
    find_acting,
    join_columns,
    place_columns,
    scale_columns,
    select_columns,
)
from tests.support.arrays import FloatArray


def make_columns() -> FloatArray:
    """Five columns, of which the second and fourth are zero."""
    columns = np.random.default_rng(0).standard_normal((7, 5))
    columns[:, [1, 3]] = 0.0
    return columns


def test_columns_are_those_of_plain_arithmetic() -> None:
    columns, scale, picked = make_columns(), np.arange(1.0, 6.0), [4, 1, 0]
    assert find_acting(columns).tolist() == [0, 2, 4]
    assert np.array_equal(scale_columns(columns, scale), columns * scale)
    assert np.array_equal(select_columns(columns, picked), columns[:, picked])
    joined = join_columns(columns, columns[:, :2])
    assert np.array_equal(joined, np.column_stack([columns, columns[:, :2]]))


def test_columns_without_any_are_empty() -> None:
    nothing = np.empty((7, 0))
    assert np.array_equal(join_columns(make_columns(), nothing), make_columns())
    assert select_columns(make_columns(), []).shape == (7, 0)
    assert not place_columns(nothing, np.empty(0, np.intp), 3).any()
