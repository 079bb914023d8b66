# SPDX-License-Identifier: MIT
"""What is known of a vehicle from design."""

from __future__ import annotations

import pytest

from drivetwin.vehicle.spec import compute_middle


@pytest.mark.parametrize("limits", [(1.0, 100.0), (0.0, 100.0), (5e3, 9e3)])
def test_the_middle_of_a_range_lies_inside_and_is_no_zero(limits: tuple[float, float]) -> None:
    assert limits[0] < compute_middle(limits) < limits[1]
    assert compute_middle((4.0, 9.0)) == pytest.approx(6.0)
