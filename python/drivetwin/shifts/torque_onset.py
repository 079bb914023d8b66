# SPDX-License-Identifier: MIT
"""Start of the torque phase: where the on-coming element begins to carry torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.signal_processing import compute_moving_mean
from drivetwin.channels.shiftlog import Channel
from drivetwin.shifts.breakaway_lockup import Boundary
from drivetwin.shifts.changepoint import Moving, fit_hinge

SMOOTH = 0.01
"""Span [s] that pressures and torque are averaged over."""
_DIP = 0.03
"""A torque dip must be this part of the torque after it, and clear of its noise."""
_BEGUN = 0.8
"""Part of the fall that is still ahead where its beginning is looked for."""
_AROUND = 0.15
"""Span [s] before that place in which the fall may have begun."""
_SHAFT = 0.015
"""A shaft of 10 Hz passes a fall on by so much later [s]."""


@dataclass(frozen=True, eq=False)
class SmoothedSignal:
    """A channel averaged over about SMOOTH; `noise` is what is left in `values` of its noise."""

    time: FloatArray
    values: FloatArray
    noise: float


def smooth_channel(channel: Channel, span: tuple[float, float]) -> SmoothedSignal:
    """Moving average of the finite samples within `span` [s], centred, so a ramp is kept."""
    keep = np.isfinite(channel.values) & (channel.time >= span[0]) & (channel.time <= span[1])
    time, values = channel.time[keep], channel.values[keep]
    width = 2 * round(0.5 * SMOOTH / channel.step) + 1
    if len(values) < width + 2:
        return SmoothedSignal(time, values, 0.0)
    noise = 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0 * width)
    return SmoothedSignal(time, compute_moving_mean(values, width), noise)


def locate_pressure_onset(
    pressure: SmoothedSignal, threshold: tuple[float, float], break_away: float
) -> Boundary | None:
    """Sustained crossing of P0 (`threshold`: value and standard deviation [Pa]); None if never.

    It is the last upward crossing before break-away, so that a filling pulse does not count, or
    the first one after it. Sigma spans the crossings of P0 ± (its own deviation and the noise).
    """
    value, std = threshold
    margin = float(np.hypot(std, pressure.noise))
    crossings = [
        _find_crossing(pressure, level, break_away)
        for level in (value - margin, value, value + margin)
    ]
    early, at, late = crossings
    if at is None:
        return None
    early = at if early is None else early
    late = 2.0 * at - early if late is None else late
    step = float(np.median(np.diff(pressure.time)))
    return Boundary(at, float(np.hypot(0.5 * max(late - early, 0.0), 0.3 * step)))


def _find_crossing(pressure: SmoothedSignal, level: float, break_away: float) -> float | None:
    """Time [s] of the upward crossing of `level` that lasts, or None."""
    above = pressure.values > level
    if not above.any():
        return None
    before = np.flatnonzero(pressure.time <= break_away)
    if len(before) and above[before[-1]]:
        below = np.flatnonzero(~above[: before[-1] + 1])
        index = int(below[-1]) + 1 if len(below) else 0
    else:
        start = int(before[-1]) + 1 if len(before) else 0
        later = np.flatnonzero(above[start:])
        if not len(later):
            return None
        index = start + int(later[0])
    if index == 0:
        return float(pressure.time[0])
    t, p = pressure.time[index - 1 : index + 1], pressure.values[index - 1 : index + 1]
    return float(t[0] + (level - p[0]) / (p[1] - p[0]) * (t[1] - t[0]))


def locate_torque_dip(torque: SmoothedSignal, break_away: float, step: float) -> Boundary | None:
    """Locate the onset of the torque dip towards break-away; None if there is no clear onset.

    Only for power-on upshifts, whose torque phase lowers the output torque by the ratios' `step`
    (new over old) at a steady engine torque. The onset is the start of the last such fall,
    since an earlier fall is caused by the driver; the delay of the shaft is subtracted. Sigma is
    that of the hinge fit, doubled because the fall need not be smooth, and that delay again.
    """
    keep = torque.time <= break_away
    time, values = torque.time[keep], torque.values[keep]
    if len(values) < 12:
        return None
    end = float(values[-1])
    fall = end * (1.0 / step - 1.0)
    if fall < max(_DIP * abs(end), 5.0 * torque.noise):
        return None
    whole = np.flatnonzero(values >= end + _BEGUN * fall)
    if not len(whole):
        return None
    at = float(time[whole[-1]])
    near = time >= at - _AROUND
    search = (max(at - 0.7 * _AROUND, float(time[near][2])), min(at + _SHAFT, float(time[-3])))
    if search[0] >= search[1]:
        return None
    floor = max(torque.noise, 1e-3 * abs(end))
    hinge = fit_hinge(time[near], values[near], Moving.AFTER, search, floor)
    if hinge is None:
        return None
    return Boundary(hinge.time - _SHAFT, float(np.hypot(2.0 * hinge.sigma, _SHAFT)))
