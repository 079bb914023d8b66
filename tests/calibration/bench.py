# SPDX-License-Identifier: MIT
"""Log of an upshift of the stated truck on a test bench."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin.calibration.compared_shift import DrivenShift
from drivetwin.calibration.input_path import DIRECT
from drivetwin.calibration.maneuver import Maneuver, OperatingPoint
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.table import POLICIES, PolicySetup
from drivetwin.channels.roles import Quantity
from drivetwin.dyno.dyno import Motion, list_sampling_instants, record_channels
from drivetwin.dyno.scenario import Sensor
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SensorErrors
from drivetwin.logs.read import read_log
from drivetwin.logs.write import convert_to_recorded_units, write_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import LoggedShift
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


def drive(
    twin: Twin,
    path: Path,
    model: DualClutch,
    *,
    stated_late: float = 0.0,
    known: bool = True,
    **bench: Any,
) -> DrivenShift:
    """Write the log of a shift of `model` and read it with the profiles that were commanded.

    The profiles are stated `stated_late` [s] behind; not `known`, the shift has none.
    """
    profiles = write_bench_log(path, model, **bench)
    log, card = read_log(path, twin.build_card()), twin.build_card()
    logged = LoggedShift(log, detect_shifts(log, card).shifts[0])
    if not known:
        return DrivenShift(logged)
    moved = (replace(one, time=one.time + stated_late) for one in profiles.signals.values())
    return DrivenShift(logged, type(profiles)(*moved), REQUEST + stated_late)


def write_bench_log(
    path: Path,
    model: DualClutch,
    late: float = 0.0,
    seed: int = 1,
    added: Any = NO_ADDED_ELEMENTS,
    way: Any = DIRECT,
) -> Any:
    """Write the log of a power-on upshift of a driveline with the starting values of the policy.

    Pressures act `late` [s] behind the logged ones, and all inputs by their `way`. Returns the
    commanded profiles on the clock of the log.
    """
    shift = Maneuver(model, OperatingPoint(1400.0, 175.0), 0.5, request=REQUEST, horizon=4.0)
    policy = POLICIES[PolicyKind.CONTROLLER](PolicySetup(shift, SYSTEM, None, 0.01))
    given: Any = policy.build_control(np.array([one.start for one in policy.parameters]))
    seen = list_sampling_instants(SENSORS, shift.horizon)
    pressures = {"B2": given.offgoing, "B3": given.oncoming}
    late_way = replace(way, pressure_delay=late)
    acting = late_way.apply(given.engine_torque, pressures, model.elements, shift.time)
    torque = acting.pop("engine torque")
    run = DrivelineTask(model, added, torque, acting, shift.build_start(), seen).simulate()
    inputs = {
        "engine_torque": given.engine_torque,
        **{f"pressure.{name}": one for name, one in pressures.items()},
    }
    motion = Motion(run, model.i_in, inputs, SensorErrors())
    channels = record_channels(SENSORS, shift.horizon, motion, 1.0, seed)
    write_log(path, tuple(convert_to_recorded_units(one) for one in channels))
    return given
