# SPDX-License-Identifier: MIT
"""Boundaries moved by hand: in order, inside the log, and what follows from them."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin import DrivetwinError
from drivetwin.workbench import phases


@pytest.fixture
def shift(identified: Any) -> Any:
    return identified.work.shifts[0]


def _move(session: Any, shift: Any, changes: dict[Any, float]) -> Any:
    work = session.work
    return phases.move_boundaries(work.require_log(), work.require_card(), shift, changes)


def test_a_moved_boundary_moves_both_phases_it_parts(identified: Any, shift: Any) -> None:
    time = shift.inertia_phase[0] + 0.01
    fields = {one.name: (one, at) for one, at in phases.get_display_times(shift).items()}
    inertia, lockup, torque = (fields[name][0] for name in ("INERTIA", "LOCKUP", "TORQUE"))
    typed = [time if one is inertia else at for one, at in fields.values()]
    changes = phases.parse_times(shift, typed)
    assert changes == {inertia: time}
    fresh = _move(identified, shift, changes)
    assert fresh.torque_phase == (shift.torque_phase[0], time)
    assert fresh.inertia_phase == (time, shift.inertia_phase[1])
    assert set(fresh.sigma) == set(shift.sigma) - {"inertia_start"}
    assert fresh.quality["torque_phase_time"] == pytest.approx(time - shift.torque_phase[0])
    late = shift.lockup_time + 0.02
    fresh = _move(identified, shift, {lockup: late})
    assert (fresh.lockup_time, fresh.inertia_phase[1], fresh.after[0]) == (late, late, late)
    assert phases.parse_times(shift, [at for _, at in fields.values()]) == {}
    with pytest.raises(DrivetwinError, match="'4 lock-up' has no time"):
        phases.parse_times(shift, [0.0, 2.2, 2.3, None, 5.0])
    with pytest.raises(DrivetwinError, match=r"'3 inertia phase starts' at .* before '2 torque"):
        _move(identified, shift, {torque: shift.inertia_phase[0] + 0.01})


@given(st.lists(st.floats(-2.0, 12.0), min_size=5, max_size=5))
@settings(max_examples=10, suppress_health_check=list(HealthCheck))
def test_any_times_are_in_order_inside_the_log_or_refused(
    identified: Any, shift: Any, times: list[float]
) -> None:
    changes = dict(zip(phases.get_display_times(shift), times, strict=True))
    try:
        fresh = _move(identified, shift, changes)
    except DrivetwinError:
        return
    found = [*phases.get_display_times(fresh).values()]
    assert all(one <= other for one, other in pairwise(found))
    assert found[0] >= identified.work.require_log()["output_speed"].time[0] - 1e-3


def test_a_drag_is_read_from_the_shape_it_moved(identified: Any, shift: Any) -> None:
    figure = phases.plot_phases(identified.work.require_log(), shift)
    places = {shape.name: k for k, shape in enumerate(figure.layout.shapes) if shape.name}
    lockup = next(one for one in phases.get_display_times(shift) if one.name == "LOCKUP")
    place = places[lockup.value]
    assert figure.layout.shapes[place].x0 == shift.lockup_time
    assert phases.parse_drag(figure, {f"shapes[{place}].x0": 5.25, "shapes[9].y0": 0.1}) == {
        lockup: 5.25
    }
    for change in ({}, {"shapes[0].x0": 1.0}, {"shapes[99].x0": 1.0}, {"xaxis.range[0]": 1.0}):
        assert phases.parse_drag(figure, change) == {}
