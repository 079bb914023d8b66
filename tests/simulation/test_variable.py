# SPDX-License-Identifier: MIT
"""Numbers with derivatives against differences of the same expression."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.simulation.variable import (
    Variable,
    exp,
    log,
    sign,
)

EXPRESSIONS: list[Callable[[float, float], float]] = [
    lambda x, y: x + 2.0 * y - 3.0,
    lambda x, y: 1.0 - x * y / (x + 5.0),
    lambda x, y: exp(-x) * y**2 + abs(y) * sign(x),
    lambda x, y: 3.0 / (x * x + y * y),
    lambda x, y: -(x**3.0) / exp(y),
    lambda x, y: x**y + 2.0**x * log(y),
    lambda x, y: (-2.0) ** 3.0 * x + (-x) ** 2.0 + y,
]
NUMBERS = st.floats(0.2, 4.0)


@given(NUMBERS, NUMBERS, st.sampled_from(EXPRESSIONS))
def test_slopes_are_those_of_differences(
    x: float, y: float, expression: Callable[[float, float], float]
) -> None:
    found = expression(Variable(x, np.array([1.0, 0.0])), Variable(y, np.array([0.0, 1.0])))
    assert isinstance(found, Variable)
    assert float(found) == pytest.approx(expression(x, y), rel=1e-14)
    step = 1e-5
    slopes = [
        (expression(x + step, y) - expression(x - step, y)) / (2.0 * step),
        (expression(x, y + step) - expression(x, y - step)) / (2.0 * step),
    ]
    assert found.slopes == pytest.approx(slopes, rel=1e-6, abs=1e-6)
