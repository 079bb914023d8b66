# SPDX-License-Identifier: MIT
"""Metrics of shift quality, each as one function of signals."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.shiftlog import Channel
from drivetwin.shifts.shift import Shift

_LATEST_REQUEST = 3.0
"""Longest time [s] from a request to the begin of the inertia phase."""
_COMMANDED = 0.05
"""Share of the largest command from which an element is commanded to close."""


def compute_duration(shift: Shift) -> float:
    """Duration of a shift [s]: from the begin of the torque phase to lock-up.

    Source: definition of this program; without a torque phase from break-away.
    """
    return shift.lockup_time - shift.torque_phase[0]


def compute_response_time(request: Channel, shift: Shift) -> float | None:
    """Time [s] from the request of the new gear to the begin of the inertia phase.

    `request` is the channel of role `requested_gear`. The request is the last change to the end
    gear, at most 3 s before the inertia phase; None without one. Source: definition of this
    program: delay after which the driver perceives a change of engine speed.
    """
    if not shift.end_gear.isdecimal():
        return None
    wanted = request.values == float(shift.end_gear)
    starts = request.time[1:][wanted[1:] & ~wanted[:-1]]
    begin = shift.inertia_phase[0]
    starts = starts[(starts <= begin) & (starts >= begin - _LATEST_REQUEST)]
    return begin - float(starts[-1]) if starts.size else None


def compute_command_response_time(command: Channel, shift: Shift) -> float | None:
    """Time [s] from the first command to the on-coming element to the begin of the inertia phase.

    `command` is the channel of role `pressure_command.<element>`. The first command is the rise
    above a twentieth of its largest value until lock-up, at most 3 s before the inertia phase;
    None without one. Source: definition of this program, as `compute_response_time`.
    """
    begin = shift.inertia_phase[0]
    inside = (command.time >= begin - _LATEST_REQUEST) & (command.time <= shift.lockup_time)
    time, values = command.time[inside], command.values[inside]
    if not values.size or not values.max() > 0.0:
        return None
    closing = values > _COMMANDED * values.max()
    starts = time[1:][closing[1:] & ~closing[:-1]]
    starts = starts[starts <= begin]
    return begin - float(starts[0]) if starts.size else None


def compute_rates(time: FloatArray, values: FloatArray) -> FloatArray:
    """Time derivatives (..., n) of `values` (..., n) sampled at `time` (n,), per s.

    Central differences, one-sided at both ends.
    """
    steps = np.diff(time)
    uniform = bool(np.allclose(steps, steps[0], rtol=1e-9, atol=0.0))
    spacing = float(steps.mean()) if uniform else time
    return np.asarray(np.gradient(values, spacing, axis=-1), dtype=np.float64)


def compute_largest_rate(time: FloatArray, values: FloatArray) -> float:
    """Largest magnitude of the time derivative of `values` (n,), in their unit per s.

    Central differences. With the angular acceleration of the wheel [rad/s^2] as `values` this is
    its peak jerk [rad/s^3]. Source: definition of jerk.
    """
    return float(np.abs(compute_rates(time, values)).max())


def compute_vibration_doses(time: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Vibration dose values (...) of accelerations (..., n); see `compute_vibration_dose`."""
    fourth = np.square(np.square(acceleration))
    return np.asarray(np.trapezoid(fourth, time, axis=-1) ** 0.25, dtype=np.float64)


def compute_vibration_dose(time: FloatArray, acceleration: FloatArray) -> float:
    """Vibration dose value (∫ a^4 dt)^¼ of `acceleration` (n,), in its unit times s^¼.

    For a in m/s^2 the unit is m/s^1.75, for rad/s^2 rad/s^1.75. The frequency weighting of the
    standard is not applied. Source: ISO 2631-1:1997, section 6.3.2.
    """
    return float(compute_vibration_doses(time, acceleration))
