# SPDX-License-Identifier: MIT
"""Delay of the output torque against the speeds of the vehicle, which it accelerates.

J_v·ω' = i_f·T_o - T_v holds at every instant whatever the gear and the clutches do, so the torque
hole of a shift shows the delay. Slow changes of the load (grade, air) are left out by a band-pass.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import uniform_filter1d

from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.findings import Code, Finding, Number
from drivetwin.logs.quality.time_alignment import (
    GRID,
    LONGEST,
    SMOOTH,
    Delay,
    Fit,
    fit_least_squares,
    is_significant_delay,
    report_delay,
    sample_means,
)

SLOW = 1.0
"""Averaging [s] whose result is taken off both sides: a load that changes slowly goes with it."""

LEAST_TIME = 1.0
"""So much time [s] clear of gaps is needed for a statement."""

DRIVEN = 10.0
"""The speed must follow the torque by so many standard deviations; brakes and noise hide it."""

ALIKE = 0.5
"""Delays of two speeds are one of the torque if they differ by less, relative to their mean."""

SPEEDS = ("wheel_speed", "output_speed")


def estimate_torque_delay(torque: Channel, speed: Channel) -> Delay | None:
    """Return how late `speed` is against `torque`; None where the log does not show it.

    Least squares of ω = g·(∫T_o dt - τ·T_o) + s·T_o' + d·T_o'' + c, all averaged over SMOOTH less
    the average over SLOW; s and d are twist and damping of a shaft between the two, c a load that
    changes steadily.
    """
    start, end = max(torque.time[0], speed.time[0]), min(torque.time[-1], speed.time[-1])
    if not SLOW < end - start <= LONGEST * max(torque.time.size, speed.time.size) * GRID:
        return None
    time = np.arange(start, end, GRID)
    drive, motion = sample_means(torque, time), sample_means(speed, time)
    unknown = ~(np.isfinite(drive) & np.isfinite(motion))
    clear = (
        uniform_filter1d(unknown.astype(float), _convert_to_width(SLOW), mode="constant", cval=1.0)
        < 1e-9
    )
    if np.count_nonzero(clear) * GRID < LEAST_TIME:
        return None
    drive, motion = np.where(unknown, 0.0, drive), np.where(unknown, 0.0, motion)
    impulse = GRID * (np.cumsum(drive) - 0.5 * drive)
    rate = np.gradient(drive, GRID)
    terms = (impulse, -drive, rate, np.gradient(rate, GRID))
    columns = [_filter_band(one)[clear] for one in terms]
    design = np.column_stack([*columns, np.ones(columns[0].size)])
    fit = fit_least_squares(design, _filter_band(motion)[clear])
    return None if fit is None else _estimate_delay(fit)


def _convert_to_width(seconds: float) -> int:
    return round(seconds / GRID)


def _filter_band(values: FloatArray) -> FloatArray:
    """Average over SMOOTH less the average over SLOW: straight lines vanish."""
    fast, slow = (uniform_filter1d(values, _convert_to_width(span)) for span in (SMOOTH, SLOW))
    return np.asarray(fast - slow)


def _estimate_delay(fit: Fit) -> Delay | None:
    """τ = (g·τ)/g with its standard deviation; None where the speed does not follow the torque."""
    gain, shifted = fit.solution[:2]
    if not gain > DRIVEN * np.sqrt(fit.covariance[0, 0]):
        return None
    value = float(shifted / gain)
    slope = np.array([-value, 1.0]) / gain
    return Delay(value, float(np.sqrt(slope @ fit.covariance[:2, :2] @ slope)))


def check_torque_delays(channels: Mapping[str, Channel]) -> list[Finding]:
    """Return findings on a significant delay between output torque and speeds.

    A delay against all speeds is attributed to the torque, else to the speed. Only the first sample
    of a repeated value is used.
    """
    if "output_torque" not in channels:
        return []
    torque = channels["output_torque"].updates
    speeds = [channels[role].updates for role in SPEEDS if role in channels]
    found = [(speed, delay) for speed in speeds if (delay := estimate_torque_delay(torque, speed))]
    late = [(speed, one.value) for speed, one in found if is_significant_delay(one, torque, speed)]
    if not late:
        return []
    values = np.array([one.value for _, one in found])
    mean = float(values.mean())
    if np.all(np.abs(values - mean) < ALIKE * abs(mean)):
        names = " and ".join(repr(speed.source_name) for speed, _ in found)
        return [_report_torque_delay(torque, -mean, names, mean < 0.0)]
    return [
        _report_torque_delay(speed, value, repr(torque.source_name), value < 0.0)
        for speed, value in late
    ]


def _report_torque_delay(channel: Channel, value: float, others: str, torque_last: bool) -> Finding:
    """Report a channel that is `value` [s] late; tyre slip too puts a speed before a torque."""
    code = Code.TORQUE_LATE_OR_SLIP if torque_last else Code.TORQUE_CLOCK_LATE
    return report_delay(code, channel, Number(value, "s"), others)
