# SPDX-License-Identifier: MIT
"""Gear shifts: gears, elements, phases and settings; their speeds and pressures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import InputError, MissingChannelError, TimeError, Where
from drivetwin.findings import Code, Finding, report
from drivetwin.logs.quality.outliers import detect_quantization
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue, ShiftKind


@dataclass(frozen=True)
class ShiftSettings:
    """Times in s, speeds in rad/s. Every field must be positive; raises InputError otherwise."""

    ratio_tolerance: float = 0.01
    """A gear may be held where |ω_in - i·ω_out| stays below this part of i·ω_out."""
    min_output_speed: float = 5.0
    """Below this output speed the vehicle counts as standing and no ratio is formed."""
    min_hold: float = 0.15
    """Shortest time at one ratio that counts as a gear held."""
    max_dropout: float = 0.05
    """A gear stays held across a disturbance of its ratio up to this long."""
    settle: float = 0.05
    """Left out of `before` after the lock-up of the shift before."""
    min_inertia_samples: int = 4
    """An inertia phase with fewer speed samples has no boundary that can be located."""
    max_inertia_phase: float = 5.0
    """A longer time between two gears is driving in neutral or an open converter, no shift."""
    max_torque_phase: float = 1.0
    """Longest time before break-away searched for the onset of the on-coming element's torque."""
    unknown_torque_phase: float = 0.2
    """Standard deviation of `torque_start` if no channel determines it."""
    hinge_window: float = 0.06
    """Span of moving slip that a boundary is fitted to; up to four times as long where it starts or
    ends gently, and longer where samples are sparse."""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not value > 0.0:
                raise InputError(
                    f"shift setting {item.name} is {value!r}",
                    "give a positive number",
                    Where(key=item.name),
                )


@dataclass(frozen=True)
class Shift:
    """One shift from gear `start_gear` to `end_gear` (names on the card), times in s.

    The four phases of THEORY section 4 are: gear held in `before`, torque phase, inertia phase,
    and `after` (the new gear locked, from `lockup_time` on). `sigma` holds one standard deviation
    of each boundary: keys `torque_start`, `inertia_start`, `lockup`.
    """

    start_gear: str
    end_gear: str
    offgoing: str
    oncoming: str
    kind: ShiftKind
    before: tuple[float, float]
    torque_phase: tuple[float, float]
    inertia_phase: tuple[float, float]
    after: tuple[float, float]
    lockup_time: float
    sigma: dict[str, float] = field(default_factory=dict)
    quality: dict[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def name(self) -> str:
        """Gears, as `2→3`."""
        return f"{self.start_gear}→{self.end_gear}"


@dataclass(frozen=True)
class RejectedShift:
    """A candidate that is no usable shift, and why; `remedy` is empty where none is known."""

    time: tuple[float, float]
    reason: str
    remedy: str = ""


_WINDOW = 0.3
"""Span before break-away [s] that decides the power state."""


_PEDAL = 0.05
"""Least accelerator position that counts as power on."""


def classify_shift(
    log: ShiftLog, up: bool, break_away: float
) -> tuple[ShiftKind, tuple[Finding, ...]]:
    """Kind of the shift; of unknown power, with a finding, if no channel indicates it.

    Power is on where the mean engine torque in the last 0.3 s before break-away [s] is positive;
    in its absence the output torque's sign or the accelerator (above 5 %) decides.
    """
    power_on: bool | None = None
    limits = {"engine_torque": 0.0, "output_torque": 0.0, "throttle": _PEDAL}
    findings: tuple[Finding, ...] = ()
    for role, limit in limits.items():
        if role in log:
            mean = _compute_mean(log, role, break_away)
            if np.isfinite(mean):
                power_on = mean > limit
                break
    else:
        findings = (report(Code.POWER_STATE_UNKNOWN),)
    return ShiftKind.from_direction(up=up, power_on=power_on), findings


def _compute_mean(log: ShiftLog, role: str, end: float) -> float:
    channel = log[role]
    grid = np.linspace(end - _WINDOW, end, 31)
    values = channel.interpolate(grid)
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


def make_shift_labels(shifts: Sequence[Shift], to: str = "→") -> list[str]:
    """Labels of the shifts of a log by their gears, `2→3`; repeated ones with the time of lock-up,
    `2→3 at 3.34 s`.
    """
    names = [f"{one.start_gear}{to}{one.end_gear}" for one in shifts]
    return [
        f"{name} at {one.lockup_time:.2f} s" if names.count(name) > 1 else name
        for name, one in zip(names, shifts, strict=True)
    ]


def compute_exclusive_spans(shifts: Sequence[Shift]) -> tuple[tuple[float, float], ...]:
    """The span [s] that each shift of one log accounts for.

    Each then starts in a gear that is surely held, and ends before the next shift's pressures act.
    """
    borders = _compute_borders(shifts)
    starts = [shifts[0].before[0], *borders]
    ends = [*borders, shifts[-1].after[1]]
    return tuple(
        (max(start, one.before[0]), min(end, one.after[1]))
        for start, end, one in zip(starts, ends, shifts, strict=True)
    )


def split_shared_gears(shifts: Sequence[Shift]) -> tuple[Shift, ...]:
    """The shifts of one log with the gears between them divided, so that they share no sample."""
    spans = compute_exclusive_spans(shifts)
    return tuple(
        replace(one, before=(start, one.before[1]), after=(one.after[0], end))
        for one, (start, end) in zip(shifts, spans, strict=True)
    )


def compute_exclusive_masks(
    shifts: Sequence[Shift], times: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.bool_], ...]:
    """Masks (n,) of the samples that are each shift's own.

    `times` (n,) [s] belong to what was made of each shift of one log. Put together, what is left
    of them increases as each of them does.
    """
    borders = _compute_borders(shifts)
    return tuple(
        np.searchsorted(borders, time, side="right") == place for place, time in enumerate(times)
    )


def _compute_borders(shifts: Sequence[Shift]) -> list[float]:
    """Middle of each gear held between two shifts; where what counts of it for the one ends before
    what counts for the other begins, the beginning of the latter."""
    return [
        b.before[0]
        if a.after[1] <= b.before[0]
        else 0.5 * (max(a.after[0], b.before[0]) + b.before[1])
        for a, b in pairwise(shifts)
    ]


HOLD = 0.3
"""Shortest time at one ratio that counts as a gear [s]."""
RESTS = 1.0
"""Shortest rest of a ratio [s] that only a gear explains: the input speed of an open gearbox falls
or rises."""
_TOLERANCE = ShiftSettings().ratio_tolerance
"""Relative difference of a ratio that rounding, slip and noise explain."""
_WIDTH = 0.1
"""Width of the blocks [s] whose ratios are compared."""


@dataclass(frozen=True)
class HeldRatio:
    """A ratio of input and output speed, the time [s] for which it is held in all, and its standard
    deviation by the scatter of blocks."""

    ratio: float
    time: float
    std: float


def find_held_ratios(speeds: GearboxSpeeds, hold: float = HOLD) -> list[HeldRatio]:
    """Find the ratios that the speeds hold, from high to low, without knowledge of the gears.

    Blocks of `_WIDTH` are reduced to their ratio; neighbours of one ratio within half of the
    tolerance make a run, and runs of `hold` [s] and more count.
    """
    size = max(2, speeds.count_samples(_WIDTH, 2))
    count = speeds.time.size // size
    if count < 2:
        return []
    shape = (count, size)
    output = speeds.output[: count * size].reshape(shape).mean(axis=1)
    inlet = speeds.input[: count * size].reshape(shape).mean(axis=1)
    moving = output > ShiftSettings().min_output_speed
    ratio = np.divide(inlet, output, out=np.full(count, np.nan), where=moving)
    period = size * speeds.step
    found: list[HeldRatio] = []
    start = 0
    for stop in range(1, count + 1):
        if stop < count and abs(ratio[stop] / ratio[start] - 1) < 0.5 * _TOLERANCE:
            continue
        run = ratio[start:stop]
        if run.size * period >= hold and np.isfinite(run).all() and run[0] > 0.0:
            # The median of normal values scatters by √(π/2) times their mean.
            std = float(np.sqrt(0.5 * np.pi) * np.std(run, ddof=1) / np.sqrt(run.size))
            found.append(HeldRatio(float(np.median(run)), run.size * period, std))
        start = stop
    return merge_equal_ratios(found)


def merge_equal_ratios(found: Iterable[HeldRatio]) -> list[HeldRatio]:
    """Merge ratios that differ by less than the tolerance; from high to low."""
    merged: list[HeldRatio] = []
    for one in sorted(found, key=lambda each: -each.ratio):
        last = merged[-1] if merged else None
        if last is not None and last.ratio / one.ratio - 1 < _TOLERANCE:
            time = last.time + one.time
            shares = (last.time / time, one.time / time)
            ratio = shares[0] * last.ratio + shares[1] * one.ratio
            # What both runs differ by beyond noise, as with late speeds, stays in the mean.
            apart = shares[0] * shares[1] * abs(last.ratio - one.ratio)
            noise = np.hypot(shares[0] * last.std, shares[1] * one.std)
            merged[-1] = HeldRatio(ratio, time, float(max(noise, apart)))
        else:
            merged.append(one)
    return merged


def is_held(ratio: float, held: Sequence[HeldRatio]) -> bool:
    """Return True if one of the ratios that are held is this one."""
    return any(abs(one.ratio / ratio - 1) <= _TOLERANCE for one in held)


def is_ratio(found: HeldRatio, stated: PriorValue) -> bool:
    """Return True if a ratio that is held can be this one of the card.

    The tolerance is that of a rounded ratio, or the 95 % interval on the card where it is wider.
    """
    tolerance = max(_TOLERANCE * stated.value, stated.half_width or 0.0)
    return abs(found.ratio - stated.value) <= tolerance


def is_shared_pressure(log: ShiftLog, offgoing: str, oncoming: str) -> bool:
    """Return True if the pressures of both elements come from the same column."""
    roles = (make_pressure_role(offgoing), make_pressure_role(oncoming))
    if any(role not in log for role in roles):
        return False
    first, second = (log[role] for role in roles)
    same = first.source_name == second.source_name and first.time.size == second.time.size
    return same and bool(np.array_equal(first.values, second.values))


def get_shift_pressures(log: ShiftLog, shift: Shift) -> dict[str, Channel]:
    """Pressure channels of both elements of a shift, by name.

    Raises MissingChannelError where one is missing.
    """
    found = {name: log.get_pressure(name) for name in (shift.offgoing, shift.oncoming)}
    if not is_shared_pressure(log, shift.offgoing, shift.oncoming):
        return found
    channel = found[shift.offgoing]
    open_ = _estimate_opening_time(channel, shift.inertia_phase)
    before = channel.time <= open_
    return {
        shift.offgoing: replace(channel, values=np.where(before, channel.values, 0.0)),
        shift.oncoming: replace(
            channel,
            role=make_pressure_role(shift.oncoming),
            values=np.where(before, 0.0, channel.values),
        ),
    }


def _estimate_opening_time(channel: Channel, phase: tuple[float, float]) -> float:
    """Instant [s] in the middle of the time in which the pressure is least."""
    inside = (channel.time >= phase[0]) & (channel.time <= phase[1])
    time, values = channel.time[inside], channel.values[inside]
    level = float(np.min(values)) + 0.05 * float(np.ptp(values))
    return float(np.median(time[values <= level]))


_LEAST = 8
"""Fewest samples that any statement on a ratio is made from."""


@dataclass(frozen=True, eq=False)
class GearboxSpeeds:
    """Input and output speed of the gearbox [rad/s], (n,) on `time` [s]; no NaN.

    `stairs` are the steps [rad/s] of input and output speed where they are rounded beyond their
    noise, else 0.
    """

    time: FloatArray
    input: FloatArray
    output: FloatArray
    findings: tuple[Finding, ...] = ()
    stairs: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def step(self) -> float:
        """Median sample interval [s]."""
        return float(np.median(np.diff(self.time)))

    def select(self, first: int, stop: int) -> GearboxSpeeds:
        """Return samples `first` to `stop`, the latter excluded."""
        part = slice(first, stop)
        return replace(self, time=self.time[part], input=self.input[part], output=self.output[part])

    def compute_sync_error(self, ratio: float) -> FloatArray:
        """ω_in - i·ω_out [rad/s], (n,): zero where the gear of `ratio` i = ic·iout is held.

        It is the slip of eq. 15 times ic of the element that makes the gear, so its zeros are the
        zeros of the slip whatever the element's own ratios and signs are.
        """
        return self.input - ratio * self.output

    def estimate_rounding(self, ratio: float) -> float:
        """Standard deviation [rad/s] that stairs of the speeds leave in `compute_sync_error`."""
        inlet, outlet = self.stairs
        return float(np.hypot(inlet, ratio * outlet) / np.sqrt(12.0))

    def count_samples(self, seconds: float, at_least: int) -> int:
        """Number of samples in a span, but no fewer than `at_least`."""
        return max(at_least, round(seconds / self.step))


def compute_gear_ratios(card: VehicleCard) -> dict[str, float]:
    """ω_in/ω_out of each gear by name (ic·iout, without the input gear)."""
    return {gear.name: gear.ratio.value for gear in card.gears}


def resample_speeds(log: ShiftLog, card: VehicleCard) -> GearboxSpeeds:
    """Bring both speeds to one time base with the ratios of a card; see `resample_geared`."""
    return resample_geared(log, card.i_in.value, card.final_drive.value)


def resample_geared(log: ShiftLog, i_in: float, final_drive: float) -> GearboxSpeeds:
    """Bring both speeds to the time base of the input speed (linear between output samples).

    Input samples inside a gap of the output speed are left out.

    Without an input speed the engine speed over i_in stands in (exact with lock-up engaged);
    without an output speed the wheel speed times the final drive, which differs by the twist rate
    of the shaft. Both substitutions are listed in `findings`. Raises MissingChannelError, and
    TimeError if the two speeds share no time.
    """
    findings: list[Finding] = []
    if "input_speed" in log:
        source, scale = log["input_speed"], 1.0
    elif "engine_speed" in log:
        source, scale = log["engine_speed"], 1.0 / i_in
        findings.append(report(Code.INPUT_SPEED_SUBSTITUTED))
    else:
        raise _describe_substitute("input_speed", "engine_speed", log)
    inlet = _select_finite(source)
    if "output_speed" in log:
        sink, factor = log["output_speed"], 1.0
    elif "wheel_speed" in log:
        sink, factor = log["wheel_speed"], final_drive
        findings.append(report(Code.OUTPUT_SPEED_SUBSTITUTED))
    else:
        raise _describe_substitute("output_speed", "wheel_speed", log)
    slow = _select_finite(sink)
    outlet = slow.interpolate(inlet.time)
    known = np.isfinite(outlet)
    count = int(np.count_nonzero(known))
    if count < _LEAST:
        raise TimeError(
            f"{source.source_name!r} and {sink.source_name!r} have {count} samples at common "
            f"times, at least {_LEAST} are needed",
            "record both speeds together, or correct time_shift in the channel mapping",
            Where(file=log.source),
        )
    return GearboxSpeeds(
        inlet.time[known],
        scale * inlet.values[known],
        factor * outlet[known],
        tuple(findings),
        (scale * detect_quantization(inlet.values), factor * detect_quantization(slow.values)),
    )


def _select_finite(channel: Channel) -> Channel:
    """The numbers of a channel, of a held one its fresh values only."""
    channel = channel.updates
    keep = np.isfinite(channel.values)
    if np.count_nonzero(keep) < 2:
        raise MissingChannelError(
            f"channel for {channel.role!r} holds fewer than two numbers",
            "map another channel to it or record it again",
            Where(channel=channel.source_name),
        )
    return replace(channel, time=channel.time[keep], values=channel.values[keep])


def _describe_substitute(wanted: str, substitute: str, log: ShiftLog) -> MissingChannelError:
    return MissingChannelError(
        f"neither {wanted!r} nor {substitute!r} is mapped; without it no ratio can be formed",
        "name the channel in a channel mapping file (--channels) or in [channels] of the card",
        Where(file=log.source),
    )
