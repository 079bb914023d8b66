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


def test_bounds_are_narrowed_widened_and_closed() -> None:
    depth = next(one for one in POLICY.parameters if one.name == "reduction_depth")
    bounds = {"reduction_depth": (0.0, 100.0), "fill_time": (0.5, 0.5), "kiss_pressure": (0.0, 9e5)}
    found = {one.name: one for one in POLICY.set_bounds(bounds).parameters}
    assert depth.start > 100.0
    assert (found["reduction_depth"].start, found["reduction_depth"].high) == (100.0, 100.0)
    assert found["fill_time"].start == 0.5
    assert not found["fill_time"].free
    assert found["kiss_pressure"].high == 9e5
    with pytest.raises(InputError, match="no parameter b"):
        POLICY.set_bounds({"b": (0.0, 1.0)})


def test_bounds_that_bind_are_listed() -> None:
    values = SPACE.to_values(np.full(len(SPACE.free), 0.5))
    assert POLICY.list_at_bounds(values) == []
    names = [POLICY.parameters[k].name for k in SPACE.free]
    values = SPACE.to_values(np.array([1.0, *np.full(len(names) - 2, 0.5), 0.0]))
    found = POLICY.list_at_bounds(values)
    assert [one.name for one, _ in found] == [names[0], names[-1]]
    assert [end for _, end in found] == [found[0][0].high, found[1][0].low]
