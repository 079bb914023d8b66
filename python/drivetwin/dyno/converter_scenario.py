# SPDX-License-Identifier: MIT
"""A power-on upshift with the torque converter open."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.channels.shiftlog import Quantity
from drivetwin.dyno.converter import OpenConverter
from drivetwin.dyno.dual_scenarios import paper_steps
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.sensors import Sensor
from drivetwin.vehicle.converter import ConverterTable

_MAP = ConverterTable(
    speed_ratio=[0.0, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95, 1.0, 1.1],
    torque_ratio=[1.9, 1.45, 1.28, 1.19, 1.09, 1.04, 1.0, 1.0, 1.0, 1.0],
    pump_torque_at_1000rpm_Nm=[900.0, 870.0, 810.0, 740.0, 640.0, 570.0, 450.0, 250.0, 0.0, -150.0],
).spec()
"""An engine of 1545 N m holds 1650 rpm at a speed ratio of 0.85."""
_ENGINE, _TURBINE = 16.0, 3.5
"""Inertias before and behind the converter [kg m^2]."""


def open_converter() -> Scenario:
    """The shift of `paper_steps` with the converter open; only the turbine is behind it."""
    base = paper_steps()
    speed = Sensor("engine_speed", Quantity.SPEED, "SpdEng", "rpm", 1000.0, 0.05, 1e-4)
    return replace(
        base,
        name=ScenarioName.OPEN_CONVERTER,
        model=replace(base.model, J1=_TURBINE),
        engine_speed=140.0,
        sensors=(*base.sensors, speed),
        J_prime_range=(1.0, 12.0),
        converter=OpenConverter(_MAP, _ENGINE),
    )
