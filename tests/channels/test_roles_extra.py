# SPDX-License-Identifier: MIT
"""Roles of motor, shafts and temperatures: quantities, places, entries of a mapping file."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.channels.mapping_file import read_mapping
from drivetwin.channels.mapping_text import format_mapping
from drivetwin.channels.read_options import ChannelSpec
from drivetwin.channels.roles import (
    ROLES,
    Quantity,
    get_extra_quantity,
    get_place,
    get_quantity,
    is_extra,
)


def test_each_extra_role_has_its_quantity_and_place() -> None:
    assert get_quantity("motor_torque") is Quantity.TORQUE
    assert get_quantity("motor_speed") is Quantity.SPEED
    assert get_quantity("shaft_torque.halfshaft") is Quantity.TORQUE
    assert get_quantity("temperature.oil") is Quantity.TEMPERATURE
    assert get_place("temperature.oil.1") == "oil.1"
    assert get_place("motor_torque") is None


@pytest.mark.parametrize("role", ["temperature", "temperature.", "shaft.x", "", "motor"])
def test_a_place_without_a_name_is_no_role(role: str) -> None:
    assert not is_extra(role)
    assert get_extra_quantity(role) is None
    with pytest.raises(KeyError):
        get_quantity(role)


def test_roles_of_shifts_are_no_extra_ones() -> None:
    assert not any(map(is_extra, (*ROLES, "pressure.B2", "pressure_command.B2")))


def test_a_mapping_file_takes_extra_roles_and_writes_them(tmp_path: Path) -> None:
    specs = {
        "motor_torque": ChannelSpec("a", unit="Nm"),
        "motor_speed": ChannelSpec("b", unit="rpm"),
        "shaft_torque.half shaft": ChannelSpec("c", unit="Nm", sign=-1),
        "temperature.oil": ChannelSpec("d", unit="°C"),
    }
    path = tmp_path / "channels.toml"
    path.write_text(format_mapping(specs), encoding="utf-8")
    assert "[channels.temperature.oil]" in path.read_text(encoding="utf-8")
    assert read_mapping(path).channels == specs
