# SPDX-License-Identifier: MIT
"""Direction, power state and order of the phases of each kind of shift."""

from __future__ import annotations

import pytest

from drivetwin.vehicle.spec import ShiftKind


def _read_power(kind: ShiftKind) -> bool | None:
    """Power state that the name of a kind states."""
    return None if "unknown" in kind.value else kind.value.startswith("power-on")


@pytest.mark.parametrize("kind", ShiftKind)
def test_direction_and_power_state_are_those_of_the_name(kind: ShiftKind) -> None:
    assert kind.is_up == ("upshift" in kind.value)
    assert ShiftKind.from_direction(up=kind.is_up, power_on=_read_power(kind)) is kind


@pytest.mark.parametrize("kind", ShiftKind)
def test_the_torque_phase_comes_first_where_the_engine_torque_opposes_the_speed_change(
    kind: ShiftKind,
) -> None:
    assumed_on = _read_power(kind) is not False
    assert kind.has_torque_phase_first == (kind.is_up == assumed_on)
