# SPDX-License-Identifier: MIT
"""Log of an upshift of the stated truck on a test bench."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policies.table import POLICIES, PolicySetup
from drivetwin.channels.roles import Quantity
from drivetwin.dyno.dyno import Motion, list_sampling_instants, record_channels
from drivetwin.dyno.scenario import Sensor
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SensorErrors
from drivetwin.logs.write import convert_to_recorded_units, write_log
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch
from tests.calibration.cases import SYSTEM

_SPEED, _TORQUE, _PRESSURE = Quantity.SPEED, Quantity.TORQUE, Quantity.PRESSURE
SENSORS = (
    Sensor("engine_torque", _TORQUE, "EngTrq", "Nm", 200.0, 2.0),
    Sensor("pressure.B2", _PRESSURE, "PrsB2", "bar", 500.0, 1e3),
    Sensor("pressure.B3", _PRESSURE, "PrsB3", "bar", 500.0, 1e3),
    Sensor("input_speed", _SPEED, "SpdIn", "rpm", 500.0, 0.05),
    Sensor("output_speed", _SPEED, "SpdOut", "rpm", 500.0, 0.03),
    Sensor("wheel_speed", _SPEED, "SpdWhl", "rpm", 500.0, 0.01),
    Sensor("output_torque", _TORQUE, "TrqOut", "Nm", 500.0, 15.0),
)


REQUEST = 1.5
"""Request in the logs of the bench [s]."""


def write_bench_log(path: Path, model: DualClutch, seed: int = 1) -> None:
    """Write the log of a power-on upshift of a driveline with the starting values of the policy."""
    shift = Maneuver(model, OperatingPoint(1400.0, 175.0), 0.5, request=REQUEST, horizon=4.0)
    policy = POLICIES[PolicyKind.CONTROLLER](PolicySetup(shift, SYSTEM, None, 0.01))
    given: Any = policy.build_control(np.array([one.start for one in policy.parameters]))
    seen = list_sampling_instants(SENSORS, shift.horizon)
    pressures = {"B2": given.offgoing, "B3": given.oncoming}
    start, torque = shift.build_start(), given.engine_torque
    run = DrivelineTask(model, NO_ADDED_ELEMENTS, torque, pressures, start, seen).simulate()
    inputs = {"engine_torque": torque, **{f"pressure.{n}": one for n, one in pressures.items()}}
    motion = Motion(run, model.i_in, inputs, SensorErrors())
    channels = record_channels(SENSORS, shift.horizon, motion, 1.0, seed)
    write_log(path, tuple(convert_to_recorded_units(one) for one in channels))
