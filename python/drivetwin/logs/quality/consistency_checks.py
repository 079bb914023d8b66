# SPDX-License-Identifier: MIT
"""Checks of a log for jumps of one channel and contradictions between channels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, find_large_steps, find_true_runs, remember_for_arrays
from drivetwin._util.display_units import format_with_unit
from drivetwin.channels.filling import Filling, Interpolation
from drivetwin.channels.roles import AUXILIARY, Quantity, format_channel_entry, get_quantity
from drivetwin.channels.shiftlog import Channel, find_uncovered_ends
from drivetwin.errors import DamagedChannelError, PlausibilityError, TimeError, Where
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.logs.quality.outliers import Damage
from drivetwin.logs.quality.time_alignment import IN_GEAR, SIGNIFICANT, estimate_final_drive
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import Z95

MAX_JUMP, MAX_ACCELERATION = 40.0, 2500.0
"""Speed change [rad/s] and rate [rad/s2] that no wheel shows between samples."""
OF_A_MOTOR = 1e4
"""Rate [rad/s2] of the other shafts by their own torque: 300 N m accelerate a motor of 0.04 kg m2
at 7500 rad/s2. A clutch or a gear that closes on the input shaft is faster."""

_CLOSES = 0.5
"""Longest time [s] in which a clutch that closes takes the input shaft along."""

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


def check_jumps(channel: Channel, beside: Mapping[str, Channel], file: str) -> None:
    """Refuse a speed that jumps further than the time since its last change allows.

    Its number has overflown, or the sensor drops out. The shaft between clutch and gears jumps as
    they close, and then turns with a neighbour; `beside` are the channels of the log.
    """
    if channel.quantity is not Quantity.SPEED or not _find_far_steps(channel.values)[0].size:
        return
    jumps = _find_steep_steps(channel, _measure_delays(channel)[1])
    if channel.role == "input_speed" and jumps.size:
        jumps = jumps[np.diff(jumps, append=channel.time.size) > 1]  # one may take several samples
        ends = np.searchsorted(channel.time, channel.time[jumps + 1] + _CLOSES)
        ends[:-1] = np.minimum(ends[:-1], jumps[1:] + 1)
        count = np.append(0, np.cumsum(_is_carried_along(channel, beside)))
        jumps = jumps[count[ends] == count[jumps + 1]]
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
        Where(file, channel.source_name, float(channel.time[index])),
    )


def _is_carried_along(channel: Channel, beside: Mapping[str, Channel]) -> NDArray[np.bool_]:
    """Return the samples (n,) at which the shaft between clutch and gears turns with the engine,
    or with the output in a ratio that the log holds while the clutch is closed."""
    nothing = np.full(channel.time.size, np.nan)
    engine, output = (
        beside[role].interpolate(channel.time) if role in beside else nothing
        for role in ("engine_speed", "output_speed")
    )
    closed = np.abs(channel.values - engine) < IN_GEAR * np.abs(engine)
    ratio = np.divide(channel.values, output, out=nothing.copy(), where=np.abs(output) > STANDSTILL)
    held = np.sort(ratio[closed & np.isfinite(ratio)])
    low, high = (np.searchsorted(held, one * ratio) for one in (1.0 - IN_GEAR, 1.0 + IN_GEAR))
    return np.asarray(closed | ((high - low) * channel.step > _HELD))


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


_COARSE = 2.1e-3
"""Step of a table [s] above which it matters how much later than its message a value is shown: with
rows of 2 ms, however their stamps are rounded, its time is known to a millisecond and better."""


def replace_filling(channel: Channel, filling: Filling | None) -> tuple[Channel, list[Finding]]:
    """Reduce a channel that was filled up to its measured samples; return it and findings.

    Comes before all other checks, which assume the noise of measured samples.
    """
    if filling is None:
        return channel, []
    if filling.interpolation is Interpolation.UNKNOWN:
        return replace(channel, filling=filling), [report(Code.FILLING_UNKNOWN, "", channel.place)]
    period, step = Number(filling.period, "s"), Number(filling.step, "s")
    measured = replace(channel, time=filling.time, values=filling.values, filling=filling)
    return measured, [
        report(
            Code.CHANNEL_FILLED,
            "",
            channel.place,
            period=period,
            step=step,
            interpolation=filling.interpolation.value,
        )
    ]


def mark_late_samples(channels: Mapping[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Mark channels as `late` that a coarse table repeats; return them by role, and findings.

    The arrival of their messages within a row is unknown. Channels with stamps of their own have
    those of the messages.
    """
    measured = {role: one for role, one in channels.items() if one.quantity not in AUXILIARY}
    held = [one for one in measured.values() if one.held]
    if not held:
        return dict(channels), []
    rows = max(measured.values(), key=lambda one: one.time.size)
    if rows.step <= _COARSE:
        return dict(channels), []
    recorded = [one for one in measured.values() if one.filling is None]
    if not all(np.isin(one.time, rows.time).all() for one in recorded):
        return dict(channels), []
    names = ", ".join(repr(one.source_name) for one in held)
    aged = {role: replace(one, late=rows.step) for role, one in measured.items()}
    step = Number(rows.step, "s")
    return {**channels, **aged}, [report(Code.TABLE_ROWS_COARSE, step=step, channels=names)]


STARTS_APART = 0.05
"""The groups of a recording start and end so far apart [s]."""

STANDSTILL = 1.0
"""Median speed [rad/s] below which a log does not show the gearing."""

FINAL_DRIVE_TOLERANCE = 0.2
"""Relative; generous to one-wheel sensors in a bend, far below any mistaken unit."""

FINAL_DRIVE_DRIFT = 0.001
"""Relative deviation of the held final drive from the card that is worth a warning: no clutch lies
between the two speeds, and J3 and the shaft's damping hang on it."""

GEAR_MARGIN = 3.0
"""Factor around the card's gears, for logs that also hold other gears; rpm/(rad/s) is 9.5."""

TORQUE_BALANCE = (0.6, 1.1)
"""Output torque over ratio times engine torque in a gear; losses and acceleration keep it below 1.

The limits leave room for both; a factor of two, as of a wrong scale, is outside.
"""

LEAST_LOAD = 0.2
"""Share of the largest engine torque above which the balance is looked at."""

_HELD = 0.3
"""Shortest time at a ratio [s] that is a gear held."""

LEAST_SAMPLES = 20
"""Least number of samples in gear."""

OPPOSED = -0.5
"""Normalised product of two torques below which one has the wrong sign."""


def check_common_span(channels: Mapping[str, Channel], file: str) -> None:
    """Raise TimeError where no time belongs to all channels: then a time base is wrong."""
    if not channels:
        return
    latest = max(channels.values(), key=lambda channel: float(channel.time[0]))
    earliest = min(channels.values(), key=lambda channel: float(channel.time[-1]))
    if latest.time[0] >= earliest.time[-1]:
        raise TimeError(
            f"no common time span: {latest.source_name!r} starts at {latest.time[0]:.3f} s, "
            f"{earliest.source_name!r} ends at {earliest.time[-1]:.3f} s",
            "set time_shift_s in the channel mapping, or export the channels on one clock",
            Where(file=file),
        )


def check_coverage(channels: Mapping[str, Channel]) -> list[Finding]:
    """Return a finding for the channels that start later or end earlier than the log."""
    measured = [one for role, one in channels.items() if get_quantity(role) not in AUXILIARY]
    if not measured:
        return []
    whole = (
        min(float(channel.time[0]) for channel in measured),
        max(float(channel.time[-1]) for channel in measured),
    )
    return [
        report(Code.NO_SAMPLES, "", channel.place, spans=f"{low:.3f} s to {high:.3f} s")
        for channel in measured
        for low, high in find_uncovered_ends(channel.updates.time, whole)
        if high - low > STARTS_APART
    ]


def check_gearing(channels: Mapping[str, Channel], card: VehicleCard, file: str) -> None:
    """Raise PlausibilityError where two speeds contradict final drive or gears of the card.

    Finds a speed with the unit of another (rpm taken as rad/s) and exchanged columns.
    """
    ratios = [gear.ratio.value for gear in card.gears]
    final = card.final_drive.value
    low, high = 1.0 - FINAL_DRIVE_TOLERANCE, 1.0 + FINAL_DRIVE_TOLERANCE
    limits = (
        ("output_speed", "wheel_speed", low * final, high * final, f"the final drive {final:g}"),
        (
            "input_speed",
            "output_speed",
            min(ratios) / GEAR_MARGIN,
            max(ratios) * GEAR_MARGIN,
            f"the gears {', '.join(f'{ratio:g}' for ratio in ratios)}",
        ),
    )
    for faster, slower, lowest, highest, gearing in limits:
        if faster not in channels or slower not in channels:
            continue
        fast, slow = channels[faster], channels[slower]
        denominator = float(np.median(slow.values))
        if denominator < STANDSTILL:
            continue
        ratio = float(np.median(fast.values)) / denominator
        if not lowest <= ratio <= highest:
            raise PlausibilityError(
                f"{faster} ({fast.source_name!r}, {fast.source_unit}) over {slower} "
                f"({slow.source_name!r}, {slow.source_unit}) is {ratio:.4g}, but the card has "
                f"{gearing}",
                "check the units of both and whether the columns are exchanged (channel mapping), "
                "or correct the card",
                Where(file=file),
            )


def check_final_drive(channels: Mapping[str, Channel], card: VehicleCard) -> list[Finding]:
    """Return a finding if the ratio of output and wheel speed is not the final drive, beyond what
    the digits on the card can mean."""
    final, found = card.final_drive, estimate_final_drive(channels)
    if found is None:
        return []
    usual = FINAL_DRIVE_DRIFT * final.value + SIGNIFICANT * found.std + Z95 * final.std
    if abs(found.value - final.value) < usual:
        return []
    outlet, wheel = channels["output_speed"], channels["wheel_speed"]
    names = {"outlet": outlet.source_name, "wheel": wheel.source_name}
    ratio, card_value = (Number(one.value, "1", one.half_width) for one in (found, final))
    return [report(Code.FINAL_DRIVE_DIFFERS, ratio=ratio, card=card_value, **names)]


def check_torque_signs(channels: Mapping[str, Channel], file: str) -> None:
    """Raise PlausibilityError where engine and output torque act against each other throughout."""
    if "engine_torque" not in channels or "output_torque" not in channels:
        return
    engine, output = channels["engine_torque"], channels["output_torque"]
    driven = output.interpolate(engine.time)
    known = np.isfinite(driven)
    product = engine.values[known] * driven[known]
    size = float(np.sqrt(np.sum(engine.values[known] ** 2) * np.sum(driven[known] ** 2)))
    if size > 0.0 and float(product.sum()) < OPPOSED * size:
        raise PlausibilityError(
            f"{engine.source_name!r} and {output.source_name!r} have opposite signs for most of "
            "the log; both count positive when the engine drives the vehicle",
            "set the sign in the channel mapping: "
            f"{format_channel_entry('output_torque', output.source_name, sign=-1)}, "
            "or that of the engine torque",
            Where(file=file),
        )


def _select_long_runs(inside: NDArray[np.bool_], time: FloatArray) -> NDArray[np.bool_]:
    """Keep the runs (n,) that last as long as a gear held; a slip passes every ratio in between."""
    kept = np.zeros_like(inside)
    for first, stop in find_true_runs(inside):
        kept[first:stop] = time[stop - 1] - time[first] >= _HELD
    return kept


def check_torque_balance(channels: Mapping[str, Channel], card: VehicleCard) -> list[Finding]:
    """Return a finding if output and engine torque do not match the ratio of the engaged gear."""
    roles = ("engine_torque", "output_torque", "input_speed", "output_speed")
    if not all(role in channels for role in roles):
        return []
    engine = channels["engine_torque"]
    output, inlet, outlet = (channels[role].interpolate(engine.time) for role in roles[1:])
    low, high = TORQUE_BALANCE
    findings = []
    loaded = (engine.values > LEAST_LOAD * engine.values.max()) & np.isfinite(output)
    for gear in card.gears:
        expected = gear.ratio.value * outlet
        near = np.abs(inlet - expected) < IN_GEAR * np.abs(expected)
        held = loaded & _select_long_runs(near, engine.time)
        if np.count_nonzero(held) < LEAST_SAMPLES:
            continue
        driving = card.compute_ratio(gear.name) * float(engine.values[held].sum())
        share = float(output[held].sum()) / driving
        if not low <= share <= high:
            names = {"engine": engine.source_name, "output": channels["output_torque"].source_name}
            shown = {"share": share, "low": low, "high": high}
            findings.append(report(Code.TORQUES_DIFFER, gear=gear.name, **names, **shown))
    return findings
