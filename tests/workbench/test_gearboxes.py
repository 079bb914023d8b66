# SPDX-License-Identifier: MIT
"""What the gearbox view shows is what the gearbox package computes."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.gearbox import list_builtin_gearboxes, load_gearbox
from drivetwin.workbench.gearboxes import list_gears, list_members, list_shifts, reduce_shift


@pytest.mark.parametrize("name", list_builtin_gearboxes())
def test_ratios_and_members_of_all_built_in_gearboxes(name: str) -> None:
    box = load_gearbox(name)
    assert all(abs(one.difference) < 0.02 for one in list_gears(box))
    members = list_members(box)
    assert members[0].name == box.input
    assert members[-1].name == box.output
    joined = {part for one in members for part in one.joined}
    assert set(box.elements) <= joined


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
