# SPDX-License-Identifier: MIT
"""View Gearbox: numbers as displayed."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.gearbox import list_builtin_gearboxes, load_gearbox, solve_gear
from drivetwin.report.gearbox import build_ratio_table, list_joints
from drivetwin.workbench.views.gearbox import _build_content, list_shifts, reduce_shift
from tests.workbench.views.texts import iterate_texts


def test_a_difference_of_zero_has_no_minus() -> None:
    texts = list(iterate_texts(_build_content(load_gearbox("three-set-4000cr"))))
    assert "+0.00" in texts
    assert "-0.00" not in texts


@pytest.mark.parametrize("name", list_builtin_gearboxes())
def test_ratios_and_members_of_all_built_in_gearboxes(name: str) -> None:
    box = load_gearbox(name)
    table = build_ratio_table(box, [solve_gear(box, one.name) for one in box.gears])
    assert all(abs(float(row[-1].text)) < 2.0 for row in table.rows)
    joints = list_joints(box)
    assert next(iter(joints)) == box.input
    assert [*joints][-1] == box.output
    assert set(box.elements) <= {part for parts in joints.values() for part in parts}


def test_a_shift_comes_with_its_error() -> None:
    box = load_gearbox("three-set-4000cr")
    assert "2-3" in list_shifts(box)
    found = reduce_shift(box, "2-3")
    assert found.reduction.off_going.element != found.reduction.on_coming.element
    assert (found.estimated is None) == (found.simulated is None) == bool(found.reason)


@pytest.mark.parametrize("shift", ["", "2", "3-2-1", "9-10", "../x"])
def test_what_is_no_shift_is_refused(shift: str) -> None:
    with pytest.raises(InputError):
        reduce_shift(load_gearbox("three-set-4000cr"), shift)
