# SPDX-License-Identifier: MIT
"""Plausibility checks of a single channel before it is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import (
    SHORTEST_STEP,
    estimate_resolution,
    find_large_steps,
    find_largest,
    find_true_runs,
    remember_for_arrays,
)
from drivetwin._util.display_units import format_with_unit
from drivetwin.channels.roles import (
    AUXILIARY,
    EXTRA_ROLES,
    ROLES,
    Quantity,
    format_channel_entry,
)
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.channels.units import BAR, RPM, find_unit, list_usual_units
from drivetwin.errors import DamagedChannelError, PlausibilityError, TimeError, Where
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.logs.quality.consistency_checks import find_lost_messages
from drivetwin.logs.quality.outliers import (
    BEYOND,
    Damage,
    compute_usual_step,
    find_clipping,
    find_dropouts,
    find_glitches,
    find_longest_rest,
    find_missing,
    find_outliers,
    find_spikes,
    find_stale,
    find_stuck,
)
from drivetwin.logs.raw import MIN_SAMPLES

MIN_SOUND = 0.5
"""Share of the samples that must hold a sound number."""

MAX_WRAPS = 3
"""So few steps back suggest a counter that wrapped, more suggest disorder."""

MAX_REPEATED = 1e-3
"""Share of samples that may repeat the stamp before them; they are left out."""

LONGEST_STEP = 0.9
"""Longest plausible sample interval [s]."""

MAX_SPARSE = 100.0
"""Time from first to last sample in units of samples times interval; more is mostly gap."""

TYPICAL_STEP = (1e-4, 0.2)
"""Sample interval [s] that a proposed unit of time must lead to."""

COARSE = 0.03
"""Resolution, as a share of the largest number, of a coarse channel; CAN engine torque has 1 %."""

MAX_AT_LIMIT = 0.1
"""Share of samples at the largest number above which an engine torque may be saturated, ..."""

SOME = 10_000
"""So many samples show the resolution of most channels."""

HELD, LONGER = 0.25, 4.0
"""... unless it holds other numbers too, for this time [s] or one that the longest there is so many
times as long as: a pedal that is held still makes such a torque."""

LEAST_SUCTION = BAR
"""A gauge pressure below -1 bar [Pa] does not exist."""

WRAP_SHARE, WRAP_CONTRAST = 0.8, 10.0
"""An overflow jumps by this share of the range, and by so many usual steps."""

WRAP_STEP, WRAP_LONGER = 15e-3, 50e-3
"""Sample interval [s] from which output torque may do so: it falls in a quarter period; and that of
engine torque and pressures, which a control moves through their range in some such intervals."""

WRAP_BESIDE, WRAP_DRIFT, WRAP_STEPS = 5, 0.02, 3.0
"""So many samples before and after an overflow move against the jump by this share of the range at
least, and by so many usual steps: a ramp moves by five, noise by less than three."""

_PLAUSIBLE: dict[Quantity, tuple[float, float]] = {
    Quantity.PRESSURE: (1e-3 * BAR, 100 * BAR),
    Quantity.SPEED: (0.1, 1.2e3),
    Quantity.TORQUE: (1.0, 1e5),
    Quantity.FRACTION: (1e-3, 2.0),
}
"""Limits of max|value| in SI over a recording that contains a shift."""

_FASTEST = 2.7e3
"""Limit of engine and gearbox input in rpm [rad/s], as of electric drives. In rad/s the limit of
all speeds holds: larger numbers are those of an engine in rpm."""

_DRIVING = ("input_speed", "engine_speed")
"""Speeds of what drives: an engine, or an electric motor."""

_IDLE = 30.0
"""Largest speed [rad/s] that engine and gearbox input exceed in any shift."""

_TYPICAL: dict[Quantity, tuple[float, float]] = {
    Quantity.PRESSURE: (1 * BAR, 60 * BAR),
    Quantity.SPEED: (10.0, 700.0),
    Quantity.TORQUE: (50.0, 3e4),
    Quantity.FRACTION: (0.05, 1.0),
}
"""Typical range of max|value|; units that bring the values into it are proposed, first the one that
brings them nearest to its middle by powers of ten."""

_MUST_VARY = frozenset(
    ("output_torque", "input_speed", "engine_speed", "output_speed", "wheel_speed")
)


def check_channel(channel: Channel, file: str) -> tuple[Channel, list[Finding]]:
    """Return the channel fit for use, and findings on its damaged samples, which are left out.

    Raises TimeError, DamagedChannelError, PlausibilityError where nothing sound would remain or the
    whole channel is in doubt.
    """
    where = Where(file=file, channel=channel.source_name)
    findings: list[Finding] = []
    repeated = _find_repeated_stamps(channel.time)
    channel = _drop_damage(channel, repeated, findings, Where())
    check_order(channel.time, where)
    _check_count(channel, channel.time.size, where)
    _check_rate(channel, where)
    findings += _check_gaps(channel)
    total = channel.time.size
    found = find_missing(channel.values)
    channel = _drop_damage(channel, found, findings)
    _check_count(channel, total, where)
    _check_variation(channel, where)
    for applies, look in _LOOKS:
        if applies(channel):
            channel = _drop_damage(channel, look(channel), findings)
            _check_count(channel, total, where)
    magnitude = channel.role, channel.quantity, channel.values, channel.source_unit
    check_magnitude(*magnitude, where)
    _check_sign(channel, where)
    _check_wraps(channel, where)
    findings += _check_limit(channel)
    findings += _check_rest(channel)
    findings += _check_rounding(channel)
    return channel, findings


def _check_gaps(channel: Channel) -> list[Finding]:
    """Report the gaps that the file itself has."""
    if not channel.gaps:
        return []
    spans = ", ".join(f"{start:.3f} s to {end:.3f} s" for start, end in channel.gaps[:3])
    more = f" and {len(channel.gaps) - 3} more" if len(channel.gaps) > 3 else ""
    return [report(Code.NO_SAMPLES, "", channel.place, spans=spans + more)]


def _check_limit(channel: Channel) -> list[Finding]:
    """Report an engine torque that rests at its largest number alone; it may be genuine."""
    if channel.role != "engine_torque":
        return []
    limit = float(channel.values[np.abs(channel.values).argmax()])
    at_limit = channel.values == limit
    share = float(np.mean(at_limit))
    if not MAX_AT_LIMIT < share < 1.0:
        return []
    rests = find_true_runs(np.diff(channel.values) == 0.0)
    there, elsewhere = (
        max((channel.time[b] - channel.time[a] for a, b in rests if at_limit[a] == at), default=0.0)
        for at in (True, False)
    )
    far = abs(limit) > BEYOND * float(np.abs(channel.values[~at_limit]).max())
    if elsewhere > min(HELD, there / LONGER) and not far:
        return []
    shown = Number(limit, channel.quantity.unit)
    return [report(Code.AT_LARGEST_NUMBER, "", channel.place, limit=shown, share=100.0 * share)]


def _check_rest(channel: Channel) -> list[Finding]:
    """Report an engine torque that stays at one number where noise would have moved it."""
    if channel.role != "engine_torque":
        return []
    fresh = channel.fresh
    span = find_longest_rest(fresh.time, fresh.values)
    if span is None:
        return []
    start, end = (Number(time, "s") for time in span)
    return [report(Code.AT_ONE_NUMBER, "", channel.place, start=start, end=end)]


def _check_rounding(channel: Channel) -> list[Finding]:
    """Report a measured channel that was rounded coarsely."""
    # Not from one sample to the next: along a ramp of a slow channel all may be many steps apart.
    numbers = channel.values
    largest = find_largest(numbers)
    if channel.quantity in AUXILIARY or _is_binary(channel.values):
        return []
    if 0.0 < estimate_resolution(numbers[:SOME]) <= COARSE * largest:
        return []
    step = estimate_resolution(numbers)
    if step <= COARSE * largest:
        return []
    shown, share = Number(step, channel.quantity.unit), 100.0 * step / largest
    return [report(Code.COARSE_RESOLUTION, "", channel.place, step=shown, share=share)]


def _is_binary(values: FloatArray) -> bool:
    """Return True if a signal has only two values, such as the pressure of an on/off valve."""
    low, high = values.min(), values.max()
    return all(bool(np.all((one == low) | (one == high))) for one in (values[:SOME], values))


def _look_at_updates(look: Look, channel: Channel) -> Damage | None:
    """Apply `look` to the updated samples of a channel; include the samples that repeat them."""
    fresh = channel.fresh
    found = look(fresh)
    if found is None or channel.raster is None:
        return found
    update = np.searchsorted(fresh.time, channel.time, side="right") - 1
    return Damage(found.mask[np.clip(update, 0, None)], found.code)


def _has_sensor_noise(channel: Channel) -> bool:
    """Return True if a channel is expected to have sensor noise."""
    return channel.role in _MUST_VARY or channel.quantity is Quantity.PRESSURE


def _find_codes(channel: Channel) -> Damage | None:
    """Find invalid-value codes; a plausible pressure may be the pulse of a valve."""
    possible = _PLAUSIBLE[Quantity.PRESSURE][1] if channel.quantity is Quantity.PRESSURE else 0.0
    return find_outliers(channel.time, channel.values, possible)


Look = Callable[[Channel], Damage | None]

_LOOKS: tuple[tuple[Callable[[Channel], bool], Look], ...] = (
    (
        lambda one: one.quantity in (Quantity.SPEED, Quantity.TORQUE),
        partial(_look_at_updates, lambda fresh: find_dropouts(fresh.time, fresh.values)),
    ),
    (lambda _: True, lambda one: find_spikes(one.time, one.values, one.quantity)),
    (lambda one: one.quantity not in AUXILIARY, partial(_look_at_updates, _find_codes)),
    (_has_sensor_noise, lambda one: find_clipping(one.values)),
    (lambda one: one.role == "engine_torque", partial(_look_at_updates, find_stuck)),
    (_has_sensor_noise, find_stuck),
    # Short cuts of an engine torque may be genuine.
    (
        lambda one: one.role == "output_torque",
        partial(_look_at_updates, lambda fresh: find_glitches(fresh.time, fresh.values)),
    ),
    (
        lambda one: one.quantity not in AUXILIARY,
        partial(_look_at_updates, lambda fresh: find_stale(fresh.values)),
    ),
    (lambda _: True, find_lost_messages),
)
"""Searches for damaged samples in their order, with the channels that each applies to."""


def _drop_damage(
    channel: Channel, damage: Damage | None, findings: list[Finding], place: Where | None = None
) -> Channel:
    """Drop the damaged samples and add a finding, by default on the channel.

    A finding on the stamps has no channel: those of a table share them, and it stands once.
    """
    if damage is None:
        return channel
    findings.append(damage.report(channel.time, channel.place if place is None else place))
    keep = ~damage.mask
    return replace(channel, time=channel.time[keep], values=channel.values[keep])


def _find_repeated_stamps(time: FloatArray) -> Damage | None:
    """Samples whose stamp repeats the one before, if they are few; more come of a wrong clock."""
    if not 0 < _count_repeated_stamps(time) <= MAX_REPEATED * time.size:
        return None
    return Damage(np.append(False, time[1:] == time[:-1]), Code.STAMPS_REPEATED)


@remember_for_arrays
def _count_repeated_stamps(time: FloatArray) -> int:
    return int(np.count_nonzero(time[1:] == time[:-1]))


def check_order(time: FloatArray, where: Where) -> None:
    """Refuse `time` (n,) [s] with stamps that are missing, repeated or run backward by a TimeError.

    Which of them is wrong is open.
    """
    if not np.isfinite(time).all():
        index = int(np.isfinite(time).argmin())
        raise TimeError(f"sample {index} has no time stamp", "remove or repair it", where)
    backward = np.flatnonzero(time[1:] <= time[:-1])
    if not backward.size:
        return
    index = int(backward[0]) + 1
    step = float(time[index] - time[index - 1])
    how = "repeats the stamp before it" if step == 0 else f"lies {-step:.6g} s before the last"
    raise TimeError(
        f"time does not increase: sample {index} {how} ({backward.size} such samples)",
        _suggest_time_remedy(time, backward),
        Where(file=where.file, channel=where.channel, time=float(time[index])),
    )


def _suggest_time_remedy(time: FloatArray, backward: NDArray[np.intp]) -> str:
    """Suggest a remedy for stamps that decrease, for example after a counter reset.

    Many repeated stamps without a decreasing one are a result of rounding.
    """
    later = np.minimum(backward + MIN_SAMPLES, time.size - 1)
    if backward.size <= MAX_WRAPS and np.all(time[later] < time[backward]):
        index = int(backward[0])
        wrapped = float(time[index] - time[index + 1])
        return (
            f"a time counter that starts again after {wrapped:.6g} s, or two recordings in one "
            "file: export with a running clock, or cut the file there"
        )
    if backward.size > MAX_WRAPS and np.all(time[backward + 1] == time[backward]):
        return "export the stamps with more decimals, or remove the repeated samples"
    return (
        "remove the repeated or misplaced samples, or map the right time column: "
        'time = { source = "...", unit = "s" }'
    )


def _check_count(channel: Channel, total: int, where: Where) -> None:
    """Refuse what has too few samples, or lost more than half of them."""
    size = channel.time.size
    if total < MIN_SAMPLES:
        what = f"only {total} samples"
    elif size < max(MIN_SAMPLES, MIN_SOUND * total):
        what = f"only {size} of {total} samples hold a sound number"
    else:
        return
    raise DamagedChannelError(
        what, "the file may be cut, or the sensor failed: export the log again", where
    )


def _check_rate(channel: Channel, where: Where) -> None:
    """Refuse stamps that jump, or are in another unit than s: no shift log is sampled like that."""
    if channel.quantity is Quantity.STATE:
        return
    step = channel.step
    if channel.time[-1] - channel.time[0] > MAX_SPARSE * channel.time.size * step:
        longest = int(np.diff(channel.time).argmax())
        pause = float(channel.time[longest + 1] - channel.time[longest])
        raise TimeError(
            f"time jumps ahead by {pause:.6g} s between two samples",
            "a damaged time stamp, or two recordings in one file: cut the log there",
            Where(where.file, where.channel, float(channel.time[longest])),
        )
    if SHORTEST_STEP <= step <= LONGEST_STEP:
        return
    fitting = [
        unit
        for unit, factor in (("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("ps", 1e-12))
        if TYPICAL_STEP[0] <= factor * step <= TYPICAL_STEP[1]
    ]
    remedy = (
        f'the stamps would fit "{fitting[0]}": assert it in the channel mapping, '
        f'time = {{ unit = "{fitting[0]}" }}'
        if fitting
        else 'check its unit of time; the channel mapping asserts one: time = { unit = "s" }'
    )
    raise TimeError(f"samples lie {step:.4g} s apart, no log of a shift does that", remedy, where)


def _check_wraps(channel: Channel, where: Where) -> None:
    """Refuse a torque or pressure that starts again at its other end and goes on as before.

    That is a number that overflows; a signal that truly jumps does not go on in the direction that
    it came from.
    """
    if channel.quantity not in (Quantity.TORQUE, Quantity.PRESSURE):
        return
    if channel.step > (WRAP_STEP if channel.role == "output_torque" else WRAP_LONGER):
        return
    values, span = channel.values, float(np.ptp(channel.values))
    near, usual = WRAP_BESIDE, compute_usual_step(values)
    least = max(WRAP_DRIFT * span, WRAP_STEPS * usual)
    jumps = find_large_steps(values, max(WRAP_SHARE * span, WRAP_CONTRAST * usual))
    for index in jumps[(jumps >= near) & (jumps < values.size - near - 1)]:
        jump = float(values[index + 1] - values[index])
        came = float(values[index] - values[index - near])
        went = float(values[index + 1 + near] - values[index + 1])
        if min(-np.sign(jump) * came, -np.sign(jump) * went) > least:
            last, first = (
                format_with_unit(float(values[k]), channel.quantity.unit)
                for k in (index, index + 1)
            )
            raise DamagedChannelError(
                f"goes on at {first} after {last}, as a number that overflows does",
                "export the channel with more bits or another scale, or cut the log there",
                Where(where.file, where.channel, float(channel.time[index])),
            )


def _check_variation(channel: Channel, where: Where) -> None:
    if channel.role in _MUST_VARY and float(np.ptp(channel.values)) == 0.0:
        raise DamagedChannelError(
            f"constant throughout ({channel.values[0]:.6g} in SI), but {channel.role} must vary in "
            "a shift",
            "check sensor and cable, or map another column to this role",
            where,
        )


def check_magnitude(
    role: str, quantity: Quantity, values: FloatArray, unit: str, where: Where
) -> None:
    """Raise PlausibilityError for a largest number that no shift log has, with the unit it fits."""
    if quantity not in _PLAUSIBLE:
        return
    lowest, highest = _PLAUSIBLE[quantity]
    if role in _DRIVING:
        known = find_unit(unit)
        lowest = _IDLE
        highest = _FASTEST if known is not None and known.factor == RPM else highest
    largest = find_largest(values)
    if largest == 0.0 or lowest <= largest <= highest:
        return
    low, high = _TYPICAL[quantity]
    fitting = {
        name: abs(np.log10(factor * largest / np.sqrt(low * high)))
        for name, factor in list_usual_units(quantity, unit)
        if low <= factor * largest <= high
    }
    units = sorted(fitting, key=lambda name: round(fitting[name]))  # of equal size the usual one
    side, limit = ("above", highest) if largest > highest else ("below", lowest)
    remedy = (
        f"the numbers would fit {' or '.join(map(repr, units))}: assert the unit in the channel "
        f"mapping, {format_channel_entry(role, where.channel or '', unit=units[0])}"
        if units
        else f"correct unit or scale of channels.{role} in the channel mapping"
    )
    raise PlausibilityError(
        f"largest {quantity} is {format_with_unit(largest, quantity.unit)}, {side} "
        f"{format_with_unit(limit, quantity.unit)}, with unit {unit!r}",
        remedy,
        where,
    )


def _format_reversed(channel: Channel) -> str:
    return format_channel_entry(channel.role, channel.source_name, sign=-1)


def _check_sign(channel: Channel, where: Where) -> None:
    """Raise PlausibilityError for a sign that is wrong by convention.

    Forward motion is positive in a vehicle; a node of any other driveline may turn backwards.
    """
    if channel.quantity is Quantity.PRESSURE:
        lowest, highest = float(channel.values.min()), float(channel.values.max())
        if -lowest > max(highest, LEAST_SUCTION):
            low, high = (format_with_unit(one, "Pa") for one in (lowest, highest))
            raise PlausibilityError(
                f"gauge pressure goes down to {low}, but up to {high} only",
                f"set the sign in the channel mapping: {_format_reversed(channel)}",
                where,
            )
    if (
        channel.quantity is Quantity.SPEED
        and channel.role in (*ROLES, *EXTRA_ROLES)
        and 2 * np.count_nonzero(channel.values < 0.0) > channel.values.size
    ):
        raise PlausibilityError(
            "the speed is negative for most of the log; forward motion counts positive",
            f"set the sign in the channel mapping: {_format_reversed(channel)}",
            where,
        )
