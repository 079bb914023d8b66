# SPDX-License-Identifier: MIT
"""Engine map with lag, converter map: published points and closed forms."""

from __future__ import annotations

import math

import pytest

from drivetwin.drive import Powertrain

RPM = math.pi / 30.0


@pytest.mark.parametrize(
    ("rpm", "full", "motoring"), [(800, 1758, -155), (1400, 2109, -203), (2100, 1079, -320)]
)
def test_engine_gives_the_published_torques(
    truck: Powertrain, rpm: float, full: float, motoring: float
) -> None:
    assert truck.engine.compute_steady_torque(1.0, rpm * RPM) == pytest.approx(full)
    assert truck.engine.compute_steady_torque(0.0, rpm * RPM) == pytest.approx(motoring)
    assert truck.engine.compute_steady_torque(0.25, rpm * RPM) == pytest.approx(
        0.25 * full + 0.75 * motoring
    )


def test_closed_pedal_holds_idle(truck: Powertrain) -> None:
    idle = truck.engine.idle
    assert truck.engine.compute_steady_torque(0.0, idle) == pytest.approx(0.0)
    assert truck.engine.compute_steady_torque(0.0, 0.95 * idle) > 500.0
    assert truck.engine.compute_steady_torque(0.0, 1.05 * idle) < -50.0


def test_converter_takes_the_published_torque_scaled_by_speed_squared(truck: Powertrain) -> None:
    converter, pump = truck.converter, 1000.0 * RPM
    assert converter.compute_pump_torque(pump, 0.0) == pytest.approx(1.79 * 404.8)
    assert converter.compute_pump_torque(2.0 * pump, 0.0) == pytest.approx(4.0 * 1.79 * 404.8)
    assert converter.compute_torque_ratio(pump, 0.5 * pump) == pytest.approx(1.328)
    assert converter.compute_pump_torque(pump, 1.22 * pump) == pytest.approx(1.79 * -80.0)


def test_road_load_is_that_of_the_vehicle(truck: Powertrain) -> None:
    """0.0065 of the weight at the tyre; ½·1.188·5.8·0.5³ per squared wheel speed."""
    assert truck.road.rolling == pytest.approx(0.0065 * 23747 * 9.81 * 0.5)
    assert truck.road.aero == pytest.approx(0.5 * 1.188 * 5.8 * 0.125)
    assert truck.road.constant == 0.0
