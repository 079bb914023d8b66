# SPDX-License-Identifier: MIT
"""What a channel must satisfy before anything is computed from it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.errors import DamagedChannelError, PlausibilityError, TimeError, Where
from drivetwin.logs.shiftlog import Channel, FloatArray, Quantity
from drivetwin.logs.units import usual_units

MIN_SAMPLES = 10
"""Fewer samples cannot show a shift."""

MAX_GAP_SAMPLES = 3
"""So many samples in a row may lack a number; a longer run is damage."""

BAR = 1e5

_PLAUSIBLE: dict[Quantity, tuple[float, float]] = {
    Quantity.PRESSURE: (1e-3 * BAR, 100 * BAR),
    Quantity.SPEED: (0.1, 1.2e3),
    Quantity.TORQUE: (1.0, 1e5),
    Quantity.FRACTION: (1e-3, 2.0),
}
"""Limits of max|value| in SI over a recording that contains a shift."""

_IDLE = 30.0
"""Largest speed [rad/s] that engine and gearbox input exceed in any shift."""

_TYPICAL: dict[Quantity, tuple[float, float]] = {
    Quantity.PRESSURE: (1 * BAR, 60 * BAR),
    Quantity.SPEED: (10.0, 700.0),
    Quantity.TORQUE: (50.0, 3e4),
    Quantity.FRACTION: (0.05, 1.0),
}
"""Where max|value| usually lies; a unit that leads there is proposed."""

_MUST_VARY = frozenset(
    ("output_torque", "input_speed", "engine_speed", "output_speed", "wheel_speed")
)


@dataclass(frozen=True)
class Checked:
    """A channel that passed, and what was left out of it."""

    channel: Channel
    warnings: tuple[str, ...] = ()


def check_channel(channel: Channel, file: str) -> Checked:
    """Return the channel fit for use.

    Raises TimeError, DamagedChannelError, PlausibilityError. Single samples without a number are
    left out, never replaced, and listed as a warning.
    """
    where = Where(file=file, channel=channel.source_name)
    _check_time(channel.time, where)
    finite = np.isfinite(channel.values)
    warnings: tuple[str, ...] = ()
    if not finite.all():
        _check_runs(channel, where)
        first = channel.time[int(finite.argmin())]
        count = int((~finite).sum())
        warnings = (
            f"channel {channel.source_name!r}: {count} samples without a number left out, the "
            f"first at {first:.6g} s",
        )
        channel = replace(channel, time=channel.time[finite], values=channel.values[finite])
    if channel.time.size < MIN_SAMPLES:
        raise DamagedChannelError(
            f"only {channel.time.size} samples", "the file may be cut: export the log again", where
        )
    _check_variation(channel, where)
    _check_magnitude(channel, where)
    _check_sign(channel, where)
    return Checked(channel, warnings)


def _check_time(time: FloatArray, where: Where) -> None:
    if not np.isfinite(time).all():
        index = int(np.isfinite(time).argmin())
        raise TimeError(f"sample {index} has no time stamp", "remove or repair it", where)
    backward = np.flatnonzero(np.diff(time) <= 0)
    if backward.size:
        index = int(backward[0]) + 1
        step = float(time[index] - time[index - 1])
        how = "repeats the stamp before it" if step == 0 else f"lies {-step:.6g} s before the last"
        raise TimeError(
            f"time does not increase: sample {index} {how} ({backward.size} such samples)",
            "remove the repeated or misplaced samples, or map the right time column: "
            'time = { source = "...", unit = "s" }',
            Where(file=where.file, channel=where.channel, time=float(time[index])),
        )


def _check_runs(channel: Channel, where: Where) -> None:
    missing = np.concatenate(([False], ~np.isfinite(channel.values), [False]))
    edges = np.flatnonzero(np.diff(missing.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2]
    long_runs = np.flatnonzero(ends - starts > MAX_GAP_SAMPLES)
    if long_runs.size:
        start, end = int(starts[long_runs[0]]), int(ends[long_runs[0]])
        more = f"; {long_runs.size} such runs" if long_runs.size > 1 else ""
        raise DamagedChannelError(
            f"{end - start} samples in a row hold no number, from {channel.time[start]:.6g} s to "
            f"{channel.time[end - 1]:.6g} s{more}",
            "cut the log to a span without the gap, or leave the cells empty if the channel was "
            "not sampled there",
            Where(where.file, where.channel, float(channel.time[start])),
        )


def _check_variation(channel: Channel, where: Where) -> None:
    if channel.role in _MUST_VARY and float(np.ptp(channel.values)) == 0.0:
        raise DamagedChannelError(
            f"constant throughout ({channel.values[0]:.6g} in SI), but {channel.role} must vary in "
            "a shift",
            "check sensor and cable, or map another column to this role",
            where,
        )


def _check_magnitude(channel: Channel, where: Where) -> None:
    if channel.quantity not in _PLAUSIBLE:
        return
    lowest, highest = _PLAUSIBLE[channel.quantity]
    if channel.role in ("input_speed", "engine_speed"):
        lowest = _IDLE
    largest = float(np.abs(channel.values).max())
    if largest == 0.0 or lowest <= largest <= highest:
        return
    low, high = _TYPICAL[channel.quantity]
    fitting = [
        name
        for name, factor in usual_units(channel.quantity, channel.source_unit)
        if low <= factor * largest <= high
    ]
    side, limit = ("above", highest) if largest > highest else ("below", lowest)
    remedy = (
        f"the numbers would fit {' or '.join(map(repr, fitting))}: assert the unit in the channel "
        f'mapping, channels.{channel.role} = {{ source = "{channel.source_name}", '
        f'unit = "{fitting[0]}" }}'
        if fitting
        else f"correct unit or scale of channels.{channel.role} in the channel mapping"
    )
    raise PlausibilityError(
        f"largest {channel.quantity} is {_show(largest, channel.quantity)}, {side} "
        f"{_show(limit, channel.quantity)}, with unit {channel.source_unit!r}",
        remedy,
        where,
    )


def _show(value: float, quantity: Quantity) -> str:
    """Value in the unit an engineer reads: bar, rpm, N·m."""
    factor, unit = {
        Quantity.PRESSURE: (1.0 / BAR, "bar"),
        Quantity.SPEED: (30.0 / np.pi, "rpm"),
        Quantity.TORQUE: (1.0, "N·m"),
    }.get(quantity, (1.0, ""))
    return f"{value * factor:.4g} {unit}".rstrip()


def _check_sign(channel: Channel, where: Where) -> None:
    if channel.quantity is Quantity.SPEED and float(np.median(channel.values)) < 0.0:
        raise PlausibilityError(
            "the speed is negative for most of the log; forward motion counts positive",
            f"set the sign in the channel mapping: channels.{channel.role} = "
            f'{{ source = "{channel.source_name}", sign = -1 }}',
            where,
        )
