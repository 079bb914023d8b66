# SPDX-License-Identifier: MIT
"""Direction, power state and order of the phases of each kind of shift."""

from __future__ import annotations

import pytest

from drivetwin.vehicle.shift_kind import ShiftKind


@pytest.mark.parametrize("kind", ShiftKind)
def test_direction_and_power_state_are_those_of_the_name(kind: ShiftKind) -> None:
    power_on = kind.value.startswith("power-on")
    assert kind.is_up == kind.value.endswith("upshift")
    assert ShiftKind.from_direction(up=kind.is_up, power_on=power_on) is kind


@pytest.mark.parametrize("kind", ShiftKind)
def test_the_torque_phase_comes_first_where_the_engine_torque_opposes_the_speed_change(
    kind: ShiftKind,
) -> None:
    assert kind.has_torque_phase_first == (kind.is_up == kind.value.startswith("power-on"))
