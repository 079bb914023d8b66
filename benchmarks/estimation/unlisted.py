# SPDX-License-Identifier: MIT
"""Mismatches outside the table of effects: errors of sensors and maps that no effect describes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import get_pressure_element
from drivetwin.channels.shiftlog import Channel
from drivetwin.dyno.dyno import DynoRun

Change = Callable[[DynoRun, Channel, float], FloatArray]
"""Recorded values (n,) of a channel with a mismatch of a size."""


class UnlistedId(StrEnum):
    """Mismatches that the table of effects does not contain, with the meaning of their size."""

    PRESSURE_HYSTERESIS = "pressure_hysteresis"
    """Half of the play between acting and recorded clutch pressures [Pa]."""
    PRESSURE_CURVATURE = "pressure_curvature"
    """Error of a pressure sensor at the middle of its range, over the range."""
    PRESSURE_STEP = "pressure_step"
    """Step of the recorded clutch pressures [Pa]."""
    FIRING_ORDER = "firing_order"
    """Amplitude of the ripple of the input speed three times per turn, over the speed."""
    CLOCK_DRIFT = "clock_drift"
    """Error of the rate of the clock of the output torque: quartz clocks have 20 to 100 ppm."""


@dataclass(frozen=True)
class Unlisted:
    """Standard deviation of the size of a mismatch and the change that it makes."""

    std: float
    change: Change


def _add_play(recorded: DynoRun, channel: Channel, size: float) -> FloatArray:
    element = get_pressure_element(channel.role)
    if element is None:
        return channel.values
    step = 1.0 / recorded.scenario.rate
    time = np.arange(0.0, recorded.scenario.duration + step, step)
    exact = recorded.scenario.actuators[element].compute_pressure(time)
    error = np.interp(channel.time, time, follow_with_play(exact, size) - exact)
    return np.asarray(np.maximum(channel.values + error, 0.0), dtype=np.float64)


def follow_with_play(values: FloatArray, half: float) -> FloatArray:
    """Return values (n,) behind a play of `half` to either side, at first in its middle."""
    followed = np.empty_like(values)
    last = float(values[0])
    for k, value in enumerate(values.tolist()):
        last = min(max(last, value - half), value + half)
        followed[k] = last
    return followed


def _bend_pressure(_: DynoRun, channel: Channel, size: float) -> FloatArray:
    if get_pressure_element(channel.role) is None:
        return channel.values
    full = float(np.max(channel.values))
    share = channel.values / full
    return channel.values + 4.0 * size * full * share * (1.0 - share)


def _round_pressure(_: DynoRun, channel: Channel, size: float) -> FloatArray:
    if get_pressure_element(channel.role) is None or size == 0.0:
        return channel.values
    return np.asarray(size * np.round(channel.values / size), dtype=np.float64)


def _add_firing(recorded: DynoRun, channel: Channel, size: float) -> FloatArray:
    if channel.role != "input_speed":
        return channel.values
    motion = recorded.trajectory
    steps = np.diff(motion.time) * 0.5 * (motion.engine_speed[1:] + motion.engine_speed[:-1])
    angle = np.interp(channel.time, motion.time, np.concatenate(([0.0], np.cumsum(steps))))
    return channel.values * (1.0 + size * np.sin(3.0 * angle))


def _stretch_time(_: DynoRun, channel: Channel, size: float) -> FloatArray:
    if channel.role != "output_torque":
        return channel.values
    acting = channel.time[0] + (1.0 - size) * (channel.time - channel.time[0])
    return np.asarray(np.interp(acting, channel.time, channel.values), dtype=np.float64)


UNLISTED: dict[UnlistedId, Unlisted] = {
    UnlistedId.PRESSURE_HYSTERESIS: Unlisted(5e3, _add_play),
    UnlistedId.PRESSURE_CURVATURE: Unlisted(0.005, _bend_pressure),
    UnlistedId.PRESSURE_STEP: Unlisted(5e3, _round_pressure),
    UnlistedId.FIRING_ORDER: Unlisted(1e-3, _add_firing),
    UnlistedId.CLOCK_DRIFT: Unlisted(1e-4, _stretch_time),
}
"""Sizes of good workshop equipment; engineering estimates."""


def add_unlisted(recorded: DynoRun, which: UnlistedId, size: float) -> DynoRun:
    """Return the run with one mismatch in its recorded channels; the truth stays."""
    change = UNLISTED[which].change
    channels = tuple(replace(one, values=change(recorded, one, size)) for one in recorded.channels)
    return replace(recorded, channels=channels)
