# SPDX-License-Identifier: MIT
"""Sensor classes: sources and limits."""

from __future__ import annotations

from drivetwin.authoring.element_questions import read_sensor_classes
from drivetwin.vehicle.card_fields import get_card_field


def test_every_class_has_a_source_and_a_limit() -> None:
    for one in read_sensor_classes().values():
        assert len(one.source) > 20
        assert one.gain_limit or one.offset_limit or one.offset_limit_share
        assert one.gain_limit / 3**0.5 <= get_card_field("sensors", "gain_tolerance").usual[1]
