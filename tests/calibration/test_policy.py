# SPDX-License-Identifier: MIT
"""Coordinates of a policy's parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policy import PolicyParameter, Space
from drivetwin.errors import InputError
from tests.calibration.cases import SYSTEM, make_upshift

POLICY = build_controller_policy(make_upshift(), SYSTEM)
SPACE = Space(POLICY)


@given(st.lists(st.floats(0.0, 1.0), min_size=len(SPACE.free), max_size=len(SPACE.free)))
def test_coordinates_and_values_are_inverse(shares: list[float]) -> None:
    given_shares = np.array(shares)
    values = SPACE.to_values(given_shares)
    assert SPACE.to_coordinates(values) == pytest.approx(given_shares, abs=1e-9)
    for one, value in zip(SPACE.policy.parameters, values, strict=True):
        assert one.low - 1e-9 <= value <= one.high * (1.0 + 1e-12) + 1e-9


def test_a_kept_parameter_keeps_its_start() -> None:
    place = next(k for k, one in enumerate(SPACE.policy.parameters) if not one.free)
    values = SPACE.to_values(np.ones(len(SPACE.free)))
    assert values[place] == SPACE.policy.parameters[place].start


def test_start_moves_onto_the_bounds() -> None:
    (moved, *_) = POLICY.set_start({"fill_pressure": 7e7}).parameters
    assert moved.start == moved.high
    with pytest.raises(InputError, match="no parameter b"):
        POLICY.set_start({"b": 0.0})


@pytest.mark.parametrize("bounds", [(1.0, 1.0, 1.0), (0.0, 1.0, 2.0), (2.0, 1.0, 1.5)])
def test_bounds_contain_the_start(bounds: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match="bounds"):
        replace(POLICY, parameters=(PolicyParameter("a", "s", *bounds, ""),))
