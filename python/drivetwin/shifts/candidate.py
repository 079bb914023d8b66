# SPDX-License-Identifier: MIT
"""From gears held, as runs of their speed ratio, to the shift between two of them.

Without a shift there is a reason.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog, find_uncovered_ends
from drivetwin.channels.units import BAR
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.shifts.breakaway_lockup import (
    SMOOTH,
    Boundary,
    locate_break_away,
    locate_lock_up,
    locate_pressure_onset,
    locate_torque_dip,
    smooth_channel,
)
from drivetwin.shifts.lockup_clutch import find_flag_start
from drivetwin.shifts.shift import (
    GearboxSpeeds,
    Shift,
    ShiftSettings,
    classify_shift,
    is_shared_pressure,
)
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue, ShiftKind

_NONE = -1
_STANDING = -2
_SPIKE = 5
"""Samples of the running median that keeps single wrong samples from ending a run."""


@dataclass(frozen=True)
class Run:
    """Samples `first` to `last` (both included) in one state: `gear` held, None for no gear."""

    gear: str | None
    first: int
    last: int


def detect_gear_runs(
    speeds: GearboxSpeeds, ratios: Mapping[str, float], settings: ShiftSettings
) -> list[Run]:
    """Cut the log into gears held and what lies between; standstill is left out.

    A ratio passed through counts as held only from `min_hold` on, and a disturbance shorter than
    `max_dropout` does not end a gear.
    """
    names = list(ratios)
    state = _classify_samples(speeds, list(ratios.values()), settings)
    time = speeds.time
    held = [
        Run(names[value], first, last)
        for value, first, last in _iterate_constant_runs(state)
        if value >= 0
    ]
    held = _merge_runs(held, time, settings.max_dropout)
    held = [run for run in held if time[run.last] - time[run.first] >= settings.min_hold]
    return _insert_gaps(held, state)


def _classify_samples(
    speeds: GearboxSpeeds, ratios: list[float], settings: ShiftSettings
) -> NDArray[np.int64]:
    """Index of the nearest gear within tolerance, or _NONE, or _STANDING; (n,)."""
    ratio = median_filter(speeds.input, _SPIKE, mode="nearest")
    output = median_filter(speeds.output, _SPIKE, mode="nearest")
    moving = output > settings.min_output_speed
    if not ratios:
        return np.where(moving, _NONE, _STANDING).astype(np.int64)
    ratio = np.divide(ratio, output, out=np.zeros_like(ratio), where=moving)
    gears = np.array(ratios)
    distance = np.abs(ratio[:, None] / gears[None, :] - 1.0)
    nearest = distance.argmin(axis=1)
    tolerance = settings.ratio_tolerance + 5.0 * _estimate_ratio_noise(ratio, moving)
    # Between close gears the tolerance must not reach the neighbour.
    gap = np.diff(np.sort(np.log(gears))).min() if len(gears) > 1 else 1.0
    close = distance.min(axis=1) < min(tolerance, 0.25 * gap)
    return np.where(moving, np.where(close, nearest, _NONE), _STANDING).astype(np.int64)


def _estimate_ratio_noise(ratio: NDArray[np.float64], moving: NDArray[np.bool_]) -> float:
    """Relative white noise of the ratio, from second differences (blind to smooth change)."""
    bend = np.diff(ratio, 2)[moving[2:] & moving[:-2]]
    level = ratio[moving]
    if not len(bend):
        return 0.0
    return float(1.4826 * np.median(np.abs(bend)) / np.sqrt(6.0) / np.median(level))


def _iterate_constant_runs(state: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """Yield (value, first, last) of every stretch of equal values."""
    edges = np.flatnonzero(np.diff(state)) + 1
    starts = np.concatenate([[0], edges])
    ends = np.concatenate([edges, [len(state)]]) - 1
    for first, last in zip(starts, ends, strict=True):
        yield int(state[first]), int(first), int(last)


def _merge_runs(held: list[Run], time: NDArray[np.float64], longest: float) -> list[Run]:
    joined: list[Run] = []
    for run in held:
        before = joined[-1] if joined else None
        if (
            before is not None
            and before.gear == run.gear
            and time[run.first] - time[before.last] <= longest
        ):
            joined[-1] = Run(run.gear, before.first, run.last)
        else:
            joined.append(run)
    return joined


def _insert_gaps(held: list[Run], state: NDArray[np.int64]) -> list[Run]:
    """Fill in what lies between the gears held, without standstill."""
    runs: list[Run] = []
    start = 0
    for run in [*held, Run(None, len(state), len(state))]:
        for value, first, last in _iterate_state_runs(state, start, run.first):
            if value != _STANDING:
                runs.append(Run(None, first, last))
        if run.gear is not None:
            runs.append(run)
        start = run.last + 1
    return runs


def _iterate_state_runs(
    state: NDArray[np.int64], start: int, stop: int
) -> Iterator[tuple[int, int, int]]:
    """Yield (value, first, last) in state[start:stop], all moving states counting as one."""
    if stop > start:
        part = np.where(state[start:stop] == _STANDING, _STANDING, _NONE)
        for value, first, last in _iterate_constant_runs(part.astype(np.int64)):
            yield value, start + first, start + last


_RATIO_DRIFT = 0.002
"""Relative deviation of a held ratio from the card that is worth a warning."""
_STEADY = 0.003
"""Relative spread below which an unknown ratio counts as a gear missing on the card."""
_GRIP = 0.05
"""Around lock-up [s] the pressure of the on-coming element must be above P0 at some time."""


class CandidateRefusedError(Exception):
    """A candidate is no usable shift; `args` are the reason and, if known, a remedy."""


@dataclass(frozen=True, eq=False)
class Search:
    """Inputs shared by all steps of the shift detection."""

    log: ShiftLog
    card: VehicleCard
    speeds: GearboxSpeeds
    ratios: dict[str, float]
    settings: ShiftSettings


def compute_ratio(speeds: GearboxSpeeds, first: int, last: int) -> FloatArray:
    """ω_in/ω_out of samples `first` to `last`, both included."""
    part = slice(first, last + 1)
    return speeds.input[part] / speeds.output[part]


def build_shift(search: Search, before: Run, after: Run) -> Shift:
    """Build the shift between two gears held; raises CandidateRefusedError with the reason."""
    speeds, settings = search.speeds, search.settings
    start_gear, end_gear = before.gear or "", after.gear or ""
    if start_gear == end_gear:
        raise CandidateRefusedError(f"gear {start_gear} slips and is held again: no change of gear")
    begin = locate_break_away(
        speeds, search.ratios[start_gear], (before.first, before.last), after.first, settings
    )
    lock = locate_lock_up(
        speeds, search.ratios[end_gear], (after.first, after.last), before.last, settings
    )
    if begin is None or lock is None:
        what = "break-away of the off-going" if begin is None else "lock-up of the on-coming"
        raise CandidateRefusedError(f"the {what} element cannot be located in its slip")
    _check_inertia_phase(search, begin, lock)
    offgoing, oncoming = (
        search.card.get_gear_element(start_gear),
        search.card.get_gear_element(end_gear),
    )
    _check_passage(search, begin, lock)
    span = _compute_usable_span(search, before, after)
    kind, findings = classify_shift(
        search.log, search.ratios[start_gear] > search.ratios[end_gear], begin.time
    )
    step = search.ratios[end_gear] / search.ratios[start_gear]
    passage = (kind, (offgoing, oncoming), step)
    onset, more = _locate_torque_start(search, passage, span[0], (begin, lock))
    if onset.time - span[0] < settings.min_hold:
        raise CandidateRefusedError(
            f"gear {start_gear} is recorded for {onset.time - span[0]:.3f} s before the torque "
            f"phase, less than min_hold = {settings.min_hold:g} s"
        )
    return Shift(
        start_gear=start_gear,
        end_gear=end_gear,
        offgoing=offgoing,
        oncoming=oncoming,
        kind=kind,
        before=(span[0], onset.time),
        torque_phase=(onset.time, begin.time),
        inertia_phase=(begin.time, lock.time),
        after=(lock.time, span[1]),
        lockup_time=lock.time,
        sigma={"torque_start": onset.sigma, "inertia_start": begin.sigma, "lockup": lock.sigma},
        findings=(*speeds.findings, *findings, *more, *_check_ratios(search, before, after)),
    )


def _check_inertia_phase(search: Search, begin: Boundary, lock: Boundary) -> None:
    time = search.speeds.time
    inside = int(np.count_nonzero((time > begin.time) & (time < lock.time)))
    if inside < search.settings.min_inertia_samples:
        raise CandidateRefusedError(
            f"too short: {inside} speed samples between break-away and lock-up, "
            f"at least {search.settings.min_inertia_samples} are needed"
        )
    gap = float(np.diff(time[(time >= begin.time) & (time <= lock.time)]).max())
    if gap > 10.0 * search.speeds.step and gap > 0.2 * (lock.time - begin.time):
        raise CandidateRefusedError(f"the speeds are missing for {gap:.3f} s of the inertia phase")


def _check_passage(search: Search, begin: Boundary, lock: Boundary) -> None:
    """Refuse what takes too long, and what rests at a ratio that the card does not have."""
    taken, longest = lock.time - begin.time, search.settings.max_inertia_phase
    resting = find_resting_ratio(search, begin.time, lock.time)
    if resting is not None:
        raise CandidateRefusedError(
            f"between the gears the ratio rests at {resting:.4g}, "
            f"which is no gear of the card ({describe_gears(search)})"
        )
    if taken > longest:
        raise CandidateRefusedError(
            f"{taken:.2f} s from break-away to lock-up, more than max_inertia_phase = {longest:g} s"
        )


def find_resting_ratio(search: Search, start: float, end: float) -> float | None:
    """First ratio held steadily for twice `min_hold` between two times [s], or None."""
    speeds, window = search.speeds, 2.0 * search.settings.min_hold
    for begin in np.arange(start, end - window, 0.5 * window):
        first, stop = np.searchsorted(speeds.time, [begin, begin + window])
        if stop - first < search.settings.min_inertia_samples:
            continue
        ratio = compute_ratio(speeds, int(first), int(stop) - 1)
        if np.ptp(np.percentile(ratio, [5, 95])) < _STEADY * np.median(ratio):
            return float(np.median(ratio))
    return None


def _compute_usable_span(search: Search, before: Run, after: Run) -> tuple[float, float]:
    """Times from and to which the two gears are held; clear of slip where a run was cut."""
    time, settle = search.speeds.time, search.settings.settle
    start = time[before.first] + (settle if before.first > 0 else 0.0)
    end = time[after.last] - (settle if after.last < len(time) - 1 else 0.0)
    return float(start), float(end)


def describe_gears(search: Search) -> str:
    """Gears of the card with their ratios, for messages."""
    return ", ".join(f"{name} {value:.4g}" for name, value in search.ratios.items())


def _locate_torque_start(
    search: Search,
    passage: tuple[ShiftKind, tuple[str, str], float],
    earliest: float,
    phase: tuple[Boundary, Boundary],
) -> tuple[Boundary, tuple[Finding, ...]]:
    """Onset of the on-coming element's torque in a `passage` (kind, elements, ratios' step).

    The findings report an implausible onset, and an onset not derived from the pressure.

    Where the on-coming element takes hold only after break-away (power-off upshift, power-on
    downshift) the torque phase before it is empty and starts at break-away.
    """
    kind, (offgoing, oncoming), step = passage
    begin = phase[0]
    if is_shared_pressure(search.log, offgoing, oncoming):
        code = Code.TORQUE_PHASE_SHARED_CLUTCH
        return begin, (report(code, offgoing=offgoing, oncoming=oncoming),)
    earliest = max(earliest, begin.time - search.settings.max_torque_phase)
    if make_pressure_role(oncoming) in search.log:
        return _locate_pressure_start(search, (offgoing, oncoming), earliest, phase)
    if "output_torque" in search.log and kind is ShiftKind.POWER_ON_UP:
        torque = smooth_channel(search.log["output_torque"], (earliest, begin.time))
        dip = locate_torque_dip(torque, begin.time, step)
        if dip is not None:
            return dip, (report(Code.TORQUE_PHASE_FROM_TORQUE, element=oncoming),)
    flag = find_flag_start(search.log, begin.time, begin.time - earliest)
    if flag is not None and kind in (ShiftKind.POWER_ON_UP, ShiftKind.POWER_UNKNOWN_UP):
        half = 0.5 * (begin.time - flag)
        boundary = Boundary(flag + half, half / float(np.sqrt(3.0)))
        finding = report(Code.TORQUE_PHASE_FROM_FLAG, element=oncoming, flag=Number(flag, "s"))
        return boundary, (finding,)
    sigma = float(np.hypot(begin.sigma, search.settings.unknown_torque_phase))
    return Boundary(begin.time, sigma), (report(Code.TORQUE_PHASE_UNKNOWN, element=oncoming),)


def _locate_pressure_start(
    search: Search,
    elements: tuple[str, str],
    earliest: float,
    phase: tuple[Boundary, Boundary],
) -> tuple[Boundary, tuple[Finding, ...]]:
    """Locate the torque start by the on-coming pressure; refuse a missing or contradictory one."""
    offgoing, oncoming = elements
    begin, lock = phase
    channel, P0 = search.log.get_pressure(oncoming), search.card.elements[oncoming].P0
    pressure = smooth_channel(channel, (earliest, lock.time + _GRIP))
    margin = 3.0 * P0.std + pressure.noise
    grip = pressure.values[pressure.time >= lock.time - _GRIP]
    if not len(grip):
        raise CandidateRefusedError(f"the pressure of {oncoming} is missing at lock-up")
    if grip.max() < P0.value - margin:
        raise CandidateRefusedError(
            f"pressures contradict the speeds: {oncoming} locks, but its pressure is only "
            f"{grip.max() / BAR:.3g} bar then, below P0 = {P0.value / BAR:.3g} bar",
            _suggest_pressure_check(oncoming),
        )
    onset = locate_pressure_onset(pressure, (P0.value, P0.std), begin.time)
    if onset is not None:
        _check_rise_samples(channel, oncoming, (earliest, onset.time))
    rest = pressure.values[pressure.time <= begin.time]
    if len(rest) and rest.min() > P0.value + margin:
        raise CandidateRefusedError(
            f"pressures contradict the speeds: {offgoing} holds the gear, but the pressure of "
            f"{oncoming} is never below {rest.min() / BAR:.3g} bar from {earliest:.3f} s on, above "
            f"P0 = {P0.value / BAR:.3g} bar; is it absolute, or in another unit?",
            _suggest_pressure_check(oncoming),
        )
    if onset is not None and onset.time <= begin.time:
        return onset, ()
    when = "nowhere" if onset is None else f"at {onset.time:.3f} s, after break-away"
    return begin, (report(Code.TORQUE_PHASE_EMPTY, element=oncoming, when=when),)


def _suggest_pressure_check(element: str) -> str:
    return (
        f"check column, unit and offset of pressure.{element} in the channel mapping, and P0_bar "
        f"of {element} on the card"
    )


def _check_rise_samples(pressure: Channel, oncoming: str, span: tuple[float, float]) -> None:
    """Refuse where the rise above P0, which ends `span` [s], lies before or between samples.

    Averaging displaces the rise next to a gap.
    """
    onset = span[1]
    for low, high in (*pressure.gaps, *find_uncovered_ends(pressure.time, span)):
        if low - SMOOTH < onset < high + SMOOTH:
            raise CandidateRefusedError(
                f"the pressure of {oncoming} is missing from {low:.3f} s to {high:.3f} s, where it "
                "comes to exceed P0: the start of the torque phase is unknown"
            )


def _check_ratios(search: Search, *runs: Run) -> tuple[Finding, ...]:
    """Return a finding if a measured ratio differs from the card (rounded ratio, scaled speed)."""
    findings = []
    for run in runs:
        gear = run.gear or ""
        ratios = compute_ratio(search.speeds, run.first, run.last)
        # The median of normal values scatters by √(π/2) times their mean.
        std = float(np.sqrt(0.5 * np.pi / ratios.size) * np.std(ratios))
        found, nominal = PriorValue(float(np.median(ratios)), std), search.ratios[gear]
        if abs(found.value / nominal - 1.0) > _RATIO_DRIFT:
            card = search.card.get_gear(gear).ratio.scale(search.card.i_in.value)
            ratio, stated = (Number(one.value, "1", one.half_width) for one in (found, card))
            findings.append(report(Code.RATIO_DEVIATES, gear=gear, ratio=ratio, card=stated))
    return tuple(findings)
