# SPDX-License-Identifier: MIT
"""What the gearbox view shows is what the gearbox package computes."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.gearbox import builtin_gearboxes, load_gearbox
from drivetwin.workbench.gearboxes import gears_of, members_of, reduced, shifts_of


@pytest.mark.parametrize("name", builtin_gearboxes())
def test_ratios_and_members_of_all_built_in_gearboxes(name: str) -> None:
    box = load_gearbox(name)
    assert all(abs(one.difference) < 0.02 for one in gears_of(box))
    members = members_of(box)
    assert members[0].name == box.input
    assert members[-1].name == box.output
    joined = {part for one in members for part in one.joined}
    assert set(box.elements) <= joined


def test_a_shift_comes_with_its_error() -> None:
    box = load_gearbox("three-set-4000cr")
    assert "2-3" in shifts_of(box)
    found = reduced(box, "2-3")
    assert found.reduction.off_going.element != found.reduction.on_coming.element
    assert (found.estimated is None) == (found.simulated is None) == bool(found.reason)


@pytest.mark.parametrize("shift", ["", "2", "3-2-1", "9-10", "../x"])
def test_what_is_no_shift_is_refused(shift: str) -> None:
    with pytest.raises(InputError):
        reduced(load_gearbox("three-set-4000cr"), shift)
