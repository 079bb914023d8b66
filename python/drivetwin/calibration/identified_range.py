# SPDX-License-Identifier: MIT
"""Findings where a calibration leaves the range that the twin was identified in."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver, Profiles
from drivetwin.errors import Where
from drivetwin.findings import Finding
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import Trajectory
from drivetwin.twin.twin import Twin
from drivetwin.validation.initial_state import CARRIES, check_range


def check_identified_range(
    twin: Twin, maneuver: Maneuver, profiles: Profiles
) -> tuple[Finding, ...]:
    """Return a finding for each quantity beyond the range of the twin's log, with the time of it.

    The nominal shift is simulated. Slip counts while its element carries torque.
    """
    run = simulate_nominal(maneuver, profiles)
    time = maneuver.time
    pressures = (profiles.offgoing, profiles.oncoming)
    seen: dict[str, tuple[FloatArray, FloatArray]] = {
        "pressure": _join(*((one.time, one.values) for one in pressures)),
        "torque": (profiles.engine_torque.time, profiles.engine_torque.values),
        "speed": (time, run.engine_speed),
        "slip": _join(*_collect_loaded_slip(run)),
    }
    findings: list[Finding] = []
    for name, (times, values) in seen.items():
        if name in twin.validity and values.size:
            low, high = twin.validity[name]
            worst = int(np.argmax(np.maximum(values - high, low - values)))
            place = Where(time=float(times[worst] - maneuver.request))
            findings += check_range(name, [values], (low, high), place)
    return tuple(findings)


def simulate_nominal(maneuver: Maneuver, profiles: Profiles) -> Trajectory:
    """Simulate the shift of the nominal driveline."""
    pressures = {
        maneuver.offgoing.name: profiles.offgoing,
        maneuver.oncoming.name: profiles.oncoming,
    }
    inputs = (profiles.engine_torque, pressures, maneuver.build_start(), maneuver.time)
    return DrivelineTask(maneuver.model, maneuver.added, *inputs).simulate()


def _collect_loaded_slip(run: Trajectory) -> list[tuple[FloatArray, FloatArray]]:
    largest = max(float(np.nanmax(np.abs(one))) for one in run.clutch_torque.values())
    found = []
    for name, slip in run.slip.items():
        loaded = np.abs(run.clutch_torque[name]) > CARRIES * largest
        found.append((run.time[loaded], np.abs(slip[loaded])))
    return found


def _join(*added: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    times, values = zip(*added, strict=True)
    return np.concatenate(times), np.concatenate(values)
