# SPDX-License-Identifier: MIT
"""Signals of a bus log as the estimators need them: samples, rounding, stretches without gaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray, Span, estimate_rounding_step
from drivetwin.channels.roles import FOR_SHIFTS
from drivetwin.channels.shiftlog import Channel, ShiftLog, find_pauses
from drivetwin.errors import MissingChannelError, Where
from drivetwin.shifts.detect import split_at_gaps
from drivetwin.shifts.lockup_clutch import find_flag_spans

SPEEDS = ("input_speed", "output_speed", "engine_speed")
"""Roles of speeds that are used."""


@dataclass(frozen=True, eq=False)
class Signal:
    """Samples of a channel: `time` (n,) [s], `values` (n,) SI, `floor` standard deviation of
    rounding."""

    source: str
    time: FloatArray
    values: FloatArray
    floor: float

    @cached_property
    def slopes(self) -> FloatArray:
        """Central differences (n,) of the values over a usual step to both sides: two stamps that
        nearly agree determine no rate."""
        step = float(np.median(np.diff(self.time)))
        ends = [np.clip(self.time + one, *self.time[[0, -1]]) for one in (-step, step)]
        first, last = (self.interpolate(one) for one in ends)
        return np.asarray((last - first) / (ends[1] - ends[0]))

    def interpolate(self, time: FloatArray) -> FloatArray:
        """Values at `time` (m,), linear between the samples."""
        return np.interp(time, self.time, self.values)

    def interpolate_smoothly(self, time: FloatArray) -> FloatArray:
        """Values at `time` (m,) of the cubics through the samples with their central differences.

        A straight line lags behind a curve by an amount that a delay resembles.
        """
        place = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, self.time.size - 2)
        step = self.time[place + 1] - self.time[place]
        u = (time - self.time[place]) / step
        first, last = self.values[place], self.values[place + 1]
        bend = step * (self.slopes[place] * (1.0 - u) - self.slopes[place + 1] * u)
        bend -= (last - first) * (1.0 - 2.0 * u)
        return np.asarray(first + u * (last - first) + u * (1.0 - u) * bend)

    def select(self, span: Span) -> tuple[FloatArray, FloatArray]:
        """Time and values of the samples inside `span` [s]."""
        keep = (self.time >= span[0]) & (self.time <= span[1])
        return self.time[keep], self.values[keep]

    def covers(self, span: Span) -> bool:
        """Return True if the samples cover `span` [s] without a gap."""
        if not self.time.size or span[0] < self.time[0] or span[1] > self.time[-1]:
            return False
        return split_at_gaps(span, find_pauses(self.time)) == (span,)


def average_neighbours(samples: FloatArray, width: int) -> FloatArray:
    """Average `width` neighbours each; return (n // width, ...) means of (n, ...) samples."""
    count = len(samples) // width
    return np.asarray(samples[: count * width].reshape(count, width, *samples.shape[1:]).mean(1))


@dataclass(frozen=True, eq=False)
class BusLog:
    """One bus log: `signals` by role, `gear` steps and `flags` (spans [s] of the shift flag).

    `stretches` [s] are the parts in which both gearbox speeds are recorded without a gap. With a
    `converter`, speed and torque of the engine are left out.
    """

    label: str
    signals: Mapping[str, Signal]
    gear: Channel | None
    flags: tuple[Span, ...] | None
    stretches: tuple[Span, ...]
    source: str = ""
    converter: bool = False

    def get_gear_value(self, time: float) -> str:
        """Gear on the bus at `time` [s]; empty if it is not recorded."""
        if self.gear is None:
            return ""
        known = self.gear.time <= time
        place = int(np.count_nonzero(known)) - 1
        value = self.gear.values[max(place, 0)]
        return f"{value:g}" if np.isfinite(value) and value == round(value) else ""


def prepare_bus_log(log: ShiftLog, label: str) -> BusLog:
    """Prepare a log that has input and output speed.

    Raises MissingChannelError without an output speed, or an input or engine speed.
    """
    signals = {role: _prepare(log[role]) for role in (*SPEEDS, "engine_torque") if role in log}
    if "engine_speed" in signals:
        signals.setdefault("input_speed", signals["engine_speed"])
    for role in FOR_SHIFTS:
        if role not in signals:
            raise MissingChannelError(
                f"no channel for {role!r}: without it no ratio can be formed",
                "name the speed of that gearbox shaft in a channel mapping file (--channels); a "
                "wheel speed does not stand in on a bus log",
                Where(file=log.source),
            )
    flag = log.channels.get("shift_in_process")
    both = [signals[role] for role in FOR_SHIFTS]
    span = (0.0, 0.0)
    if all(one.time.size for one in both):
        span = (max(float(one.time[0]) for one in both), min(float(one.time[-1]) for one in both))
    gaps = tuple(gap for one in both for gap in find_pauses(one.time))
    return BusLog(
        label,
        signals,
        log.channels.get("gear"),
        None if flag is None else find_flag_spans(flag),
        tuple(split_at_gaps(span, gaps)) if span[1] > span[0] else (),
        log.source,
    )


def _prepare(channel: Channel) -> Signal:
    updates = channel.updates
    finite = np.isfinite(updates.values)
    values = updates.values[finite]
    step = float(estimate_rounding_step(values))
    return Signal(channel.source_name, updates.time[finite], values, step / float(np.sqrt(12.0)))
