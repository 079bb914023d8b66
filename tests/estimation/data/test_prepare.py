# SPDX-License-Identifier: MIT
"""Sensor tolerances of a log as prepared for the estimators."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.data.prepare import prepare
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import PriorValue, SensorTolerance, ShiftKind
from tests.shifts.fixtures import make_card

KINDS = {
    "engine_torque": Quantity.TORQUE,
    "output_torque": Quantity.TORQUE,
    "input_speed": Quantity.SPEED,
    "output_speed": Quantity.SPEED,
    "wheel_speed": Quantity.SPEED,
    "pressure.B2": Quantity.PRESSURE,
    "pressure.B3": Quantity.PRESSURE,
}
TORQUE = SensorTolerance(0.01, 30.0)
TORQUES = {"engine_torque": SensorTolerance(), "output_torque": TORQUE}
SHIFT = Shift(
    "2", "3", "B2", "B3", ShiftKind.POWER_ON_UP,
    before=(10.0, 20.0), torque_phase=(20.0, 20.2), inertia_phase=(20.2, 20.6),
    after=(20.6, 30.0), lockup_time=20.6,
)  # fmt: skip


def _collect(
    sensors: Mapping[str, SensorTolerance], late: float = 0.0, engine: bool = False
) -> Mapping[str, SensorTolerance]:
    """Collect the tolerances for a log of channels that are noise about 100."""
    rng, time = np.random.default_rng(0), np.arange(0.0, 40.0, 0.01)
    roles: dict[str, Any] = {**KINDS, **({"engine_speed": Quantity.SPEED} if engine else {})}
    channels = {
        role: Channel(role, kind, time, rng.normal(100.0, 1.0, time.size), role, "", late=late)
        for role, kind in roles.items()
    }
    if engine:
        turns = replace(channels["engine_speed"], values=1.2 * channels["input_speed"].values)
        channels["engine_speed"] = turns
    card = replace(make_card({"2": 1.91, "3": 1.43}), i_in=PriorValue(1.2), sensors=sensors)
    return prepare(ShiftLog(channels, "made", ""), card, FoundShifts((SHIFT,), ())).design.sensors


def test_the_tolerance_of_the_speed_sensor_that_is_read_is_one_of_the_engine_speed() -> None:
    """Behind an input gear of 1.2 the offset of the input speed is one of the engine's speed."""
    of_input, of_engine = SensorTolerance(1e-3, 0.5), SensorTolerance(2e-3, 0.1)
    stated = {**TORQUES, "input_speed": of_input, "engine_speed": of_engine}
    read = {**TORQUES, "engine_speed": SensorTolerance(1e-3, 0.6)}
    assert _collect(stated) == read
    assert _collect(stated, engine=True) == {**read, "engine_speed": of_engine}


def test_rows_that_show_values_late_make_ages_uncertain() -> None:
    stated = {**TORQUES, "output_torque": replace(TORQUE, delay=4e-3)}
    assert _collect(stated) == stated
    found, spread = _collect(stated, late=0.01), 0.01 / float(np.sqrt(12.0))
    assert found["output_torque"] == replace(TORQUE, delay=float(np.hypot(4e-3, spread)))
    assert found["engine_speed"] == found["pressure.B2"] == SensorTolerance(delay=spread)
    assert "input_speed" not in found


def test_a_torque_without_a_stated_tolerance_has_the_usual_gain_error() -> None:
    assert _collect({}) == {
        "engine_torque": SensorTolerance(gain=0.01),
        "output_torque": SensorTolerance(gain=0.005),
    }
    assert _collect(TORQUES) == TORQUES
