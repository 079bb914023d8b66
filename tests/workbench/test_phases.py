# SPDX-License-Identifier: MIT
"""Boundaries moved by hand: in order, inside the log, and what follows from them."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.findings import render
from drivetwin.workbench.phases import (
    Boundary,
    get_boundary_times,
    get_display_times,
    move_boundaries,
    parse_drag,
    parse_times,
    plot_phases,
)
from drivetwin.workbench.session import Session


def test_a_moved_boundary_moves_both_phases_it_parts(identified: Session) -> None:
    work = identified.work
    log, card, shift = work.require_log(), work.require_card(), work.shifts[0]
    time = shift.inertia_phase[0] + 0.01
    fresh = move_boundaries(log, card, shift, {Boundary.INERTIA: time})
    assert fresh.torque_phase == (shift.torque_phase[0], time)
    assert fresh.inertia_phase == (time, shift.inertia_phase[1])
    assert "inertia_start" not in fresh.sigma
    assert fresh.sigma["lockup"] == shift.sigma["lockup"]
    assert fresh.quality["torque_phase_time"] == pytest.approx(time - shift.torque_phase[0])
    assert any("set by hand" in text for text in render(fresh.findings))


def test_lock_up_moves_the_end_of_the_inertia_phase(identified: Session) -> None:
    work = identified.work
    shift = work.shifts[0]
    time = shift.lockup_time + 0.02
    fresh = move_boundaries(work.require_log(), work.require_card(), shift, {Boundary.LOCKUP: time})
    assert (fresh.lockup_time, fresh.inertia_phase[1], fresh.after[0]) == (time, time, time)


def test_nothing_moved_is_the_same_shift(identified: Session) -> None:
    work = identified.work
    shift = work.shifts[0]
    assert (
        move_boundaries(work.require_log(), work.require_card(), shift, get_boundary_times(shift))
        is shift
    )


def test_a_typed_time_leaves_the_other_boundaries_as_detected(identified: Session) -> None:
    work = identified.work
    shift = work.shifts[0]
    fields = {**get_display_times(shift), Boundary.INERTIA: 2.50005}
    assert fields[Boundary.TORQUE] != get_boundary_times(shift)[Boundary.TORQUE]
    changes = parse_times(shift, list(fields.values()))
    assert changes == {Boundary.INERTIA: 2.50005}
    fresh = move_boundaries(work.require_log(), work.require_card(), shift, changes)
    assert set(fresh.sigma) == set(shift.sigma) - {"inertia_start"}
    assert parse_times(shift, list(get_display_times(shift).values())) == {}


def test_a_field_without_a_time_is_told(identified: Session) -> None:
    with pytest.raises(InputError, match="'4 lock-up' has no time"):
        parse_times(identified.work.shifts[0], [0.0, 2.2, 2.3, None, 5.0])


def test_the_torque_phase_may_be_empty_but_not_negative(identified: Session) -> None:
    work = identified.work
    shift = work.shifts[0]
    late = {Boundary.TORQUE: shift.inertia_phase[0] + 0.01}
    with pytest.raises(InputError, match=r"'3 inertia phase starts' at .* lies before '2 torque"):
        move_boundaries(work.require_log(), work.require_card(), shift, late)


@given(st.lists(st.floats(-2.0, 12.0), min_size=5, max_size=5))
@settings(max_examples=30, suppress_health_check=list(HealthCheck))
def test_any_times_are_in_order_inside_the_log_or_refused(
    identified: Session, times: list[float]
) -> None:
    work = identified.work
    changes = dict(zip(Boundary, times, strict=True))
    try:
        fresh = move_boundaries(work.require_log(), work.require_card(), work.shifts[0], changes)
    except InputError:
        return
    found = list(get_boundary_times(fresh).values())
    assert all(one <= other for one, other in pairwise(found))
    assert found[0] >= work.require_log()["output_speed"].time[0]


def test_a_drag_is_read_from_the_shape_it_moved(identified: Session) -> None:
    work = identified.work
    figure = plot_phases(work.require_log(), work.shifts[0])
    names = [shape.name for shape in figure.layout.shapes]
    place = names.index(Boundary.LOCKUP.value)
    assert parse_drag(figure, {f"shapes[{place}].x0": 5.25, f"shapes[{place}].y0": 0.1}) == {
        Boundary.LOCKUP: 5.25
    }


@pytest.mark.parametrize(
    "change", [{}, {"shapes[0].x0": 1.0}, {"shapes[99].x0": 1.0}, {"xaxis.range[0]": 1.0}]
)
def test_other_changes_of_the_figure_move_nothing(
    identified: Session, change: dict[str, object]
) -> None:
    work = identified.work
    assert parse_drag(plot_phases(work.require_log(), work.shifts[0]), change) == {}


def test_each_boundary_has_a_line_at_its_time(identified: Session) -> None:
    work = identified.work
    shapes = plot_phases(work.require_log(), work.shifts[0]).layout.shapes
    lines = {shape.name: shape.x0 for shape in shapes if shape.type == "line" and shape.name}
    assert lines == {one.value: time for one, time in get_boundary_times(work.shifts[0]).items()}
