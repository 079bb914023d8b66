# SPDX-License-Identifier: MIT
"""The table of a torque converter: what it becomes, and what no converter can be."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import ValidationError

from drivetwin.vehicle.spec import ConverterTable

TABLE: dict[str, Any] = {
    "speed_ratio": [0.0, 0.8, 1.0, 1.25],
    "torque_ratio": [1.9, 1.1, 1.0, 1.0],
    "pump_torque_at_1000rpm_Nm": [400.0, 250.0, 0.0, -90.0],
}


def test_torques_at_a_thousand_turns_become_a_capacity() -> None:
    found = ConverterTable(**TABLE, scale=2.0).to_spec()
    pump = 2000.0 * math.pi / 30.0
    assert found.compute_pump_torque(pump, 0.8 * pump) == pytest.approx(2.0 * 4.0 * 250.0)
    assert found.compute_turbine_torque(pump, 0.8 * pump) == pytest.approx(1.1 * 2.0 * 4.0 * 250.0)


@pytest.mark.parametrize(
    ("key", "values", "message"),
    [
        ("torque_ratio", [1.9, 1.1, 1.0], "go with the points"),
        ("speed_ratio", [0.0, 1.0, 0.8, 1.25], "must increase"),
        ("torque_ratio", [1.9, -1.1, 1.0, 1.0], "must not be negative"),
        ("torque_ratio", [1.9, 11.0, 1.0, 1.0], "more power leaves than enters at .* 0.8 "),
        ("torque_ratio", [1.9, 1.1, 1.0, 0.7], "more power leaves than enters at .* 1.25 "),
        (
            "pump_torque_at_1000rpm_Nm",
            [400.0, 250.0, 90.0, 90.0],
            "more power leaves than enters at .* 1.25 ",
        ),
    ],
)
def test_what_no_converter_can_be_is_refused(key: str, values: Any, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        ConverterTable(**TABLE | {key: values})


def test_a_measured_map_may_give_a_little_too_much_near_synchronism() -> None:
    near = TABLE | {"speed_ratio": [0.0, 0.92, 1.0, 1.25], "torque_ratio": [1.9, 1.1, 1.0, 1.0]}
    assert ConverterTable(**near).to_spec().torque_ratio[1] == 1.1
    # The pump's torque crosses zero a little early, and in overrun a little is missing.
    table = TABLE | {"speed_ratio": [0.0, 0.8, 0.97, 1.03], "torque_ratio": [1.9, 1.1, 1.0, 0.93]}
    table["pump_torque_at_1000rpm_Nm"] = [400.0, 250.0, -4.0, -20.0]
    assert ConverterTable(**table).to_spec().torque_ratio[3] == 0.93
