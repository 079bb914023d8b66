# SPDX-License-Identifier: MIT
"""Log of an upshift of the stated truck on a test bench."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policy import Space
from drivetwin.channels.shiftlog import Quantity
from drivetwin.dyno.dyno import Motion, list_sampling_instants, record_channels
from drivetwin.dyno.sensors import Sensor
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import TorqueError
from drivetwin.logs.write import convert_to_recorded_units, write_log
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.simulation.vehicle_parts import NO_PARTS, VehicleParts
from tests.calibration.cases import SYSTEM, build_profiles

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


def write_bench_log(
    path: Path,
    model: DualClutch,
    late: float = 0.0,
    seed: int = 1,
    parts: VehicleParts = NO_PARTS,
) -> None:
    """Write the log of a power-on upshift of a driveline with the starting values of the policy.

    Pressures act `late` [s] behind the logged ones.
    """
    shift = Maneuver(model, OperatingPoint(1400.0, 175.0), 0.5, request=1.5, horizon=4.0)
    space = Space(build_controller_policy(shift, SYSTEM))
    given = build_profiles(space, space.start)
    seen = list_sampling_instants(SENSORS, shift.horizon)
    pressures = {"B2": given.offgoing, "B3": given.oncoming}
    acting = given.delay_pressures(late).sample(
        1e-3 * np.arange(round(1e3 * shift.horizon) + 1, dtype=np.float64)
    )
    run = DrivelineTask(
        model,
        parts,
        given.engine_torque,
        {"B2": acting.offgoing, "B3": acting.oncoming},
        shift.build_start(),
        seen,
    ).simulate()
    inputs = {
        "engine_torque": given.engine_torque,
        **{f"pressure.{name}": one for name, one in pressures.items()},
    }
    motion = Motion(run, model.i_in, inputs, TorqueError())
    channels = record_channels(SENSORS, shift.horizon, motion, 1.0, seed)
    write_log(path, tuple(convert_to_recorded_units(one) for one in channels))
