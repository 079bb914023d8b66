# SPDX-License-Identifier: MIT
"""Boundaries moved by hand: in order, inside the log, and what follows from them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin import DrivetwinError
from drivetwin.workbench.identifying import Boundary


@pytest.fixture
def shift(identified: Any) -> Any:
    return identified.work.shifts[0]


def _move(session: Any, changes: dict[Boundary, float]) -> Any:
    session.update(lambda work: work.apply_moves(0, changes))
    return session.work.shifts[0]


@pytest.fixture(autouse=True)
def _go_back(identified: Any) -> Iterator[None]:
    yield
    identified.update(lambda work: work.apply_moves(0, {}))


def test_a_moved_boundary_moves_both_phases_it_parts(identified: Any, shift: Any) -> None:
    time = shift.inertia_phase[0] + 0.01
    fresh = _move(identified, {Boundary.INERTIA: time})
    assert fresh.torque_phase == (shift.torque_phase[0], time)
    assert fresh.inertia_phase == (time, shift.inertia_phase[1])
    assert set(fresh.sigma) == set(shift.sigma) - {"inertia_start"}
    assert fresh.quality["torque_phase_time"] == pytest.approx(time - shift.torque_phase[0])
    late = shift.lockup_time + 0.02
    fresh = _move(identified, {Boundary.LOCKUP: late})
    assert (fresh.lockup_time, fresh.inertia_phase[1], fresh.after[0]) == (late, late, late)
    with pytest.raises(DrivetwinError, match=r"'3 inertia phase starts' at .* before '2 torque"):
        _move(identified, {Boundary.TORQUE: time + 0.01})


@given(st.lists(st.floats(-2.0, 12.0), min_size=5, max_size=5))
@settings(max_examples=10, suppress_health_check=list(HealthCheck))
def test_any_times_are_in_order_inside_the_log_or_refused(
    identified: Any, times: list[float]
) -> None:
    try:
        fresh = _move(identified, dict(zip(Boundary, times, strict=True)))
    except DrivetwinError:
        return
    found = (fresh.before[0], fresh.torque_phase[0], *fresh.inertia_phase, fresh.after[1])
    assert all(one <= other for one, other in pairwise(found))
    assert found[0] >= identified.work.require_log()["output_speed"].time[0] - 1e-3
