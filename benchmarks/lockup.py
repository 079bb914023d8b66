# SPDX-License-Identifier: MIT
"""Lock-up clutch of a real torque converter: fit one recorded event, predict the other.

    python -m benchmarks.lockup [FOLDER]

FOLDER (default ../shared/lockup) holds two public events at 50 Hz: near-lock with break-away, and
the release before a 2-3 shift. It is not part of the project; without it the benchmark is skipped.
The fit published with the record stands beside: kiss pressure 700 mbar, dead time 60 ms, lag 110 ms
rising and 140 ms falling, friction 0.375 N·m/mbar static and 0.300 kinetic. It states no inertia
and no torque of the fluid: both are fitted to the same event. The torque of the fluid depends on
the engine speed, which is not recorded, so that its coefficient is fitted to the predicted event,
for both.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.lockup import (
    IdentifiedLockup,
    LockupClutch,
    SlipRecord,
    check_lockup,
    identify_lockup,
    simulate_slip,
)
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, HeldSignal
from drivetwin.channels.units import RPM
from drivetwin.estimation.result.estimate import Z95

_EVENTS = ("g55_tcc_d4_breakaway.csv", "g55_tcc_2to3_shift.csv")
_MBAR = 100.0
_NOISE = 25.0 * RPM
"""Noise of the slip, and torques that the model lacks [rad/s]."""
_PUBLISHED = LockupClutch(
    ActuatorModel(0.060, 0.110 / 2.0, 0.140 / 2.0, 1.0, 700.0 * _MBAR),
    kinetic=0.300 / _MBAR,
    peak=0.375 / 0.300,
    inertia=0.25,
    fluid=1.0,
)
"""The published fit. Half of a first-order lag each way has the same mean delay by second order."""
_INERTIAS: FloatArray = np.arange(0.05, 0.85, 0.05)
_FLUIDS: FloatArray = np.arange(0.0, 15.1, 0.25)
_RELEASED = 40.0 * RPM


def read_event(file: Path) -> SlipRecord:
    """Read command, engine torque and slip of an event."""
    table = np.genfromtxt(file, delimiter=",", skip_header=2)
    time = np.ascontiguousarray(table[:, 0])
    command = HeldSignal(time, _MBAR * table[:, 2])
    return SlipRecord(command, time, table[:, 3], RPM * table[:, 4], _NOISE)


def compute_error(clutch: LockupClutch, event: SlipRecord) -> float:
    """Root mean square error of the slip [rad/s]."""
    return float(np.sqrt(np.mean(np.square(simulate_slip(clutch, event) - event.slip))))


def fit_fluid(clutch: LockupClutch, event: SlipRecord) -> LockupClutch:
    """Return the clutch with the coefficient of the fluid that fits the event."""
    tried = [replace(clutch, fluid=float(one)) for one in _FLUIDS]
    return min(tried, key=lambda one: compute_error(one, event))


def fit_published(event: SlipRecord) -> LockupClutch:
    """Return the published fit with the inertia and fluid that fit the event."""
    tried = [fit_fluid(replace(_PUBLISHED, inertia=float(one)), event) for one in _INERTIAS]
    return min(tried, key=lambda one: compute_error(one, event))


def find_release(time: FloatArray, slip: FloatArray) -> float:
    """First time [s] at which the slip is above 40 rpm; NaN without one."""
    above = np.flatnonzero(slip > _RELEASED)
    return float(time[above[0]]) if above.size else float("nan")


def format_row(name: str, clutch: LockupClutch, fitted: SlipRecord, other: SlipRecord) -> str:
    """Row of the table: error of the fit, error and break-away of the prediction."""
    predicted = fit_fluid(clutch, other)
    late = find_release(other.time, simulate_slip(predicted, other)) - find_release(
        other.time, other.slip
    )
    errors = [compute_error(clutch, fitted) / RPM, compute_error(predicted, other) / RPM]
    return f"| {name} | {errors[0]:.0f} | {errors[1]:.0f} | {1e3 * late:+.0f} |\n"


def format_clutch(found: IdentifiedLockup) -> str:
    """Identified values with 95 % intervals."""
    model, clutch = found.actuator.model, found.clutch
    std = dict(zip(QUANTITIES, Z95 * found.actuator.std, strict=True))
    own = Z95 * found.std
    lags = [2e3 * model.damping * one for one in (model.rising_lag, model.falling_lag)]
    return (
        f"dead time {1e3 * model.dead_time:.0f} ± {1e3 * std['dead_time']:.0f} ms, "
        f"mean lag {lags[0]:.0f} ± {2e3 * std['rising_lag']:.0f} ms rising, "
        f"{lags[1]:.0f} ± {2e3 * std['falling_lag']:.0f} ms falling, "
        f"kiss {model.kiss_pressure / _MBAR:.0f} ± {std['kiss_pressure'] / _MBAR:.0f} mbar, "
        f"kinetic {_MBAR * clutch.kinetic:.2f} ± {_MBAR * own[0]:.2f} N·m/mbar, "
        f"static over kinetic {clutch.peak:.2f} ± {own[1]:.2f}, "
        f"J {clutch.inertia:.2f} ± {own[2]:.2f} kg·m²\n"
    )


def main() -> int:
    """Fit each event and predict the other."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/lockup")
    if any(not (folder / name).is_file() for name in _EVENTS):
        sys.stdout.write(f"skipped: {folder} does not hold {' and '.join(_EVENTS)}\n")
        return 0
    events = [read_event(folder / name) for name in _EVENTS]
    alone = {}
    for name, fitted, other in zip(_EVENTS, events, events[::-1], strict=True):
        found = alone[name] = identify_lockup([fitted])
        sys.stdout.write(f"fitted to {name}: {format_clutch(found)}")
        sys.stdout.write("| fit | error, rpm | error of the other event, rpm | break-away, ms |\n")
        sys.stdout.write("|---|---|---|---|\n")
        sys.stdout.write(format_row("identified", found.clutch, fitted, other))
        sys.stdout.write(format_row("published", fit_published(fitted), fitted, other))
    for one in check_lockup(alone):
        sys.stdout.write(f"{one.text}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
