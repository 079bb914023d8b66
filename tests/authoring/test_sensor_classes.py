# SPDX-License-Identifier: MIT
"""Sensor classes: sources, limits, and what is refused."""

from __future__ import annotations

import pytest

from drivetwin.authoring.sensor_classes import list_classes, parse_sensor, read_sensor_classes
from drivetwin.vehicle.card_fields import get_card_field

ROLES = {"engine_torque": "torque", "wheel_speed": "speed", "pressure": "pressure"}


def test_every_class_has_a_source_and_a_limit() -> None:
    for one in read_sensor_classes().values():
        assert len(one.source) > 20
        assert one.gain_limit or one.offset_limit or one.offset_limit_share
        assert one.gain_limit / 3**0.5 <= get_card_field("sensors", "gain_tolerance").usual[1]


@pytest.mark.parametrize("role", ROLES)
def test_classes_are_those_of_the_quantity(role: str) -> None:
    names = list_classes(role)
    assert names
    assert {read_sensor_classes()[name].quantity for name in names} == {ROLES[role]}


def test_tolerance_is_the_limit_over_root_three() -> None:
    sensor = parse_sensor(" torque-flange:5000 ", "output_torque")
    assert sensor is not None
    assert sensor.gain_tolerance == pytest.approx(0.001 / 3**0.5)
    assert sensor.offset_tolerance == pytest.approx(5.0 / 3**0.5)


@pytest.mark.parametrize(
    "text", ["", "flange", "torque-flange", "torque-flange:-1", "torque-flange:inf", "ecu-car:5",
             "pressure-gauge:25"],
)  # fmt: skip
def test_wrong_sensors_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"class|range"):
        parse_sensor(text, "engine_torque")


def test_none_states_no_sensor() -> None:
    assert parse_sensor("none", "pressure") is None
