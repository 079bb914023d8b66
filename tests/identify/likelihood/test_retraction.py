# SPDX-License-Identifier: MIT
"""A step keeps what it promised of the friction law; other unknowns move as they are told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.identify.friction import stribeck
from drivetwin.identify.likelihood.unknowns import LAW, RETRACTION_SLIPS, retract
from drivetwin.identify.optimize.objective import Point

NAMES = ("eta", *(f"B3.{key}" for key in LAW), "B2.mu_c")
START = np.array([0.9, 0.11, 0.02, 1e-4, np.log(12.0), 0.12])


@given(
    st.lists(st.floats(-0.02, 0.02), min_size=3, max_size=3),
    st.floats(-np.log(12.0), np.log(5.0)),
)
def test_the_law_takes_the_step_in_its_values(mu: list[float], by_scale: float) -> None:
    step = np.array([0.01, mu[0], mu[1], 1e-2 * mu[2], by_scale, 0.003])
    before, slopes = stribeck(START[1:5], RETRACTION_SLIPS)
    found = retract(Point(NAMES, START), step)
    assert stribeck(found[1:5], RETRACTION_SLIPS)[0] == pytest.approx(
        before + slopes.T @ step[1:5], abs=1e-9
    )
    assert found[4] == START[4] + by_scale
    assert found[[0, 5]] == pytest.approx([0.91, 0.123])


def test_without_a_change_of_v_s_the_step_is_straight() -> None:
    step = np.array([0.0, 1e-3, -2e-3, 1e-5, 0.0, 0.0])
    assert retract(Point(NAMES, START), step) == pytest.approx(START + step)
