# SPDX-License-Identifier: MIT
"""Jumps of a speed: lost messages, and numbers that overflow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import remember_for_arrays
from drivetwin._util.display_units import format_with_unit
from drivetwin._util.signal_processing import find_large_steps
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.errors import DamagedChannelError, Where
from drivetwin.findings import Code
from drivetwin.logs.quality.outliers import Damage

MAX_JUMP, MAX_ACCELERATION = 40.0, 2500.0
"""Speed change [rad/s] and rate [rad/s2] that no wheel shows between samples."""
OF_A_MOTOR = 1e4
"""Rate [rad/s2] of the other shafts: 300 N m accelerate a motor of 0.04 kg m2 at 7500 rad/s2."""

CLOSE = 2.5
"""Samples within so many median intervals follow each other; a longer pause is one of the file."""


def find_lost_messages(channel: Channel) -> Damage | None:
    """Find samples of a speed that repeat an old value until it jumps as far as that time allows.

    A logger that writes a row for each message repeats a value while its messages are lost.
    """
    if channel.quantity is not Quantity.SPEED:
        return None
    if not _find_far_steps(channel.values)[0].size:
        return None
    steep = _find_steep_steps(channel, np.diff(channel.time))
    fresh, since = _measure_delays(channel)
    usual = np.median(since[np.diff(channel.values) != 0.0]) if steep.size else 0.0
    known = np.isin(steep, _find_steep_steps(channel, since), invert=True)
    mask = np.zeros(channel.time.size, np.bool_)
    for index in steep[known & (since[steep] > CLOSE * usual)].tolist():
        mask[fresh[index] + 1 : index + 1] = True
    return Damage(mask, Code.MESSAGES_LOST) if mask.any() else None


def check_jumps(channel: Channel, where: Where) -> None:
    """Refuse a speed that jumps further than the time since its last change allows.

    Its number has overflown, or the sensor drops out.
    """
    if channel.quantity is not Quantity.SPEED:
        return
    if not _find_far_steps(channel.values)[0].size:
        return
    jumps = _find_steep_steps(channel, _measure_delays(channel)[1])
    if not jumps.size:
        return
    index = int(jumps[0]) + 1
    before, after = (
        format_with_unit(float(channel.values[place]), channel.quantity.unit)
        for place in (index - 1, index)
    )
    raise DamagedChannelError(
        f"jumps from {before} to {after} between two samples ({jumps.size} such jumps)",
        "the number may overflow or the sensor drop out: cut the log to a sound span, or map "
        "another channel",
        Where(where.file, where.channel, float(channel.time[index])),
    )


def _find_steep_steps(channel: Channel, pause: FloatArray) -> NDArray[np.intp]:
    """Return the samples after which a speed changes too fast for a `pause` (n-1,) [s]."""
    far, change = _find_far_steps(channel.values)
    close = channel.time[far + 1] - channel.time[far] <= CLOSE * channel.step
    fastest = MAX_ACCELERATION if channel.role == "wheel_speed" else OF_A_MOTOR
    return np.asarray(far[close & (change > fastest * pause[far])])


@remember_for_arrays
def _find_far_steps(values: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the samples after which a speed jumps, and the sizes of the jumps."""
    far = find_large_steps(values, MAX_JUMP)
    return far, np.abs(values[far + 1] - values[far])


def _measure_delays(channel: Channel) -> tuple[NDArray[np.intp], FloatArray]:
    """Return where the value of each sample appeared, and the time [s] from there to the next.

    Both are of shape (n-1,).
    """
    changed = np.diff(channel.values, prepend=np.nan) != 0.0
    fresh = np.maximum.accumulate(np.where(changed, np.arange(changed.size), 0))[:-1]
    return fresh, channel.time[1:] - channel.time[fresh]
