# SPDX-License-Identifier: MIT
"""Shifts and their four phases from a log and a vehicle card (THEORY section 4)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.shifts.boundaries import Boundary, break_away, lock_up
from drivetwin.shifts.held import Run, gear_runs
from drivetwin.shifts.kind import shift_kind
from drivetwin.shifts.kinematics import FloatArray, GearboxSpeeds, gear_ratios, gearbox_speeds
from drivetwin.shifts.quality import shift_quality
from drivetwin.shifts.settings import ShiftSettings
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.shifts.torque_onset import pressure_onset, smoothed, torque_dip_onset
from drivetwin.vehicle.spec import VehicleCard

_RATIO_DRIFT = 0.002
"""Relative deviation of a held ratio from the card that is worth a warning."""
_STEADY = 0.003
"""Relative spread below which an unknown ratio counts as a gear missing on the card."""


class _NoShiftError(Exception):
    """A candidate turned out to be no usable shift; the text is the reason."""


class FoundShifts(NamedTuple):
    """What a log holds: usable shifts and refused candidates, both in order of time."""

    shifts: tuple[Shift, ...]
    rejected: tuple[RejectedShift, ...]


@dataclass(frozen=True)
class _Search:
    """What every step of the search needs."""

    log: ShiftLog
    card: VehicleCard
    speeds: GearboxSpeeds
    ratios: dict[str, float]
    settings: ShiftSettings


def find_shifts(
    log: ShiftLog, card: VehicleCard, settings: ShiftSettings | None = None
) -> FoundShifts:
    """Find every gear shift of a log, its phases and quality figures, and the candidates refused.

    A gear is held where ω_in = ic·iout·ω_out (zero slip, eq. 15, of the element that makes it).
    Between two gears held, the inertia phase runs from the hinge at which the off-going slip
    leaves zero to the one at which the on-coming slip reaches it; the torque phase precedes it,
    from the on-coming pressure's crossing of P0 (without it: from the fall of the output torque).
    Raises MissingChannelError where a speed is missing, TimeError where the speeds share no time.
    """
    speeds = gearbox_speeds(log, card)
    search = _Search(log, card, speeds, gear_ratios(card), settings or ShiftSettings())
    runs = gear_runs(speeds, search.ratios, search.settings)
    if not runs:
        return FoundShifts((), (_standing(search),))
    shifts: list[Shift] = []
    rejected = [
        RejectedShift(_span(speeds, run), reason)
        for index, run in enumerate(runs)
        if (reason := _unfinished(search, runs, index))
    ]
    held = [run for run in runs if run.gear is not None]
    for before, after in pairwise(held):
        if _interrupted(runs, before, after):
            continue
        try:
            shifts.append(_shift(search, before, after))
        except _NoShiftError as no_shift:
            span = (float(speeds.time[before.last]), float(speeds.time[after.first]))
            rejected.append(RejectedShift(span, str(no_shift)))
    chained = _chain(shifts, search.settings)
    finished = tuple(replace(s, quality=shift_quality(log, card, s)) for s in chained)
    return FoundShifts(finished, tuple(sorted(rejected, key=lambda item: item.time)))


def _standing(search: _Search) -> RejectedShift:
    speeds = search.speeds
    return RejectedShift(
        (float(speeds.time[0]), float(speeds.time[-1])),
        f"the output speed is never above {search.settings.min_output_speed:g} rad/s "
        f"(highest {speeds.output.max():.4g} rad/s): standstill, or the wrong sign or unit",
    )


def _span(speeds: GearboxSpeeds, run: Run) -> tuple[float, float]:
    return float(speeds.time[run.first]), float(speeds.time[run.last])


def _interrupted(runs: list[Run], before: Run, after: Run) -> bool:
    """Whether the vehicle stood still between two gears held."""
    between = [run for run in runs if before.last < run.first and run.last < after.first]
    missing = (after.first - before.last - 1) - sum(run.last - run.first + 1 for run in between)
    return missing > 0


def _unfinished(search: _Search, runs: list[Run], index: int) -> str:
    """Why a stretch without gear belongs to no shift with a gear on either side; empty if none."""
    run, speeds = runs[index], search.speeds
    if run.gear is not None:
        return ""
    before = runs[index - 1] if index > 0 else None
    after = runs[index + 1] if index + 1 < len(runs) else None
    if before is not None and _interrupted(runs, before, run):
        before = None
    if after is not None and _interrupted(runs, run, after):
        after = None
    start, end = _span(speeds, run)
    if end - start < search.settings.min_hold or (before and after):
        return ""
    ratio = _ratio(speeds, run.first, run.last)
    measured = f"measured ratio {ratio.min():.4g} to {ratio.max():.4g}"
    resting = _resting_ratio(search, start, end)
    if resting is not None:
        return f"steady ratio {resting:.4g} matches no gear of the card ({_gear_list(search)})"
    if before is None and after is None:
        return f"no gear of the card is held; {measured}"
    if before is None:
        return f"no gear is held before gear {after.gear if after else ''}; {measured}"
    return (
        f"slip reaches zero in no gear after gear {before.gear}: the on-coming element "
        f"does not lock before the recording or the motion ends; {measured}"
    )


def _ratio(speeds: GearboxSpeeds, first: int, last: int) -> FloatArray:
    part = slice(first, last + 1)
    return speeds.input[part] / speeds.output[part]


def _shift(search: _Search, before: Run, after: Run) -> Shift:
    """Build the shift between two gears held, or say with _NoShiftError why there is none."""
    speeds, settings = search.speeds, search.settings
    start_gear, end_gear = before.gear or "", after.gear or ""
    if start_gear == end_gear:
        raise _NoShiftError(f"gear {start_gear} slips and is held again: no change of gear")
    begin = break_away(
        speeds, search.ratios[start_gear], (before.first, before.last), after.first, settings
    )
    lock = lock_up(
        speeds, search.ratios[end_gear], (after.first, after.last), before.last, settings
    )
    if begin is None or lock is None:
        what = "break-away of the off-going" if begin is None else "lock-up of the on-coming"
        raise _NoShiftError(f"the {what} element cannot be located in its slip")
    _check_inertia_phase(search, begin, lock)
    offgoing, oncoming = search.card.element_of(start_gear), search.card.element_of(end_gear)
    _check_passage(search, begin, lock)
    span = _usable(search, before, after)
    kind, warnings = shift_kind(
        search.log, search.ratios[start_gear] > search.ratios[end_gear], begin.time
    )
    onset, more = _torque_start(search, oncoming, span[0], (begin, lock))
    if onset.time - span[0] < settings.min_hold:
        raise _NoShiftError(
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
        warnings=(*speeds.warnings, *warnings, *more, *_ratio_warnings(search, before, after)),
    )


def _check_inertia_phase(search: _Search, begin: Boundary, lock: Boundary) -> None:
    time = search.speeds.time
    inside = int(np.count_nonzero((time > begin.time) & (time < lock.time)))
    if inside < search.settings.min_inertia_samples:
        raise _NoShiftError(
            f"too short: {inside} speed samples between break-away and lock-up, "
            f"at least {search.settings.min_inertia_samples} are needed"
        )
    gap = float(np.diff(time[(time >= begin.time) & (time <= lock.time)]).max())
    if gap > 10.0 * search.speeds.step and gap > 0.2 * (lock.time - begin.time):
        raise _NoShiftError(f"the speeds are missing for {gap:.3f} s of the inertia phase")


def _check_passage(search: _Search, begin: Boundary, lock: Boundary) -> None:
    """Refuse what takes too long, and what rests at a ratio that the card does not have."""
    taken, longest = lock.time - begin.time, search.settings.max_inertia_phase
    resting = _resting_ratio(search, begin.time, lock.time)
    if resting is not None:
        raise _NoShiftError(
            f"between the gears the ratio rests at {resting:.4g}, "
            f"which is no gear of the card ({_gear_list(search)})"
        )
    if taken > longest:
        raise _NoShiftError(
            f"{taken:.2f} s from break-away to lock-up, more than max_inertia_phase = {longest:g} s"
        )


def _resting_ratio(search: _Search, start: float, end: float) -> float | None:
    """First ratio held steadily for twice `min_hold` between two times [s], or None."""
    speeds, window = search.speeds, 2.0 * search.settings.min_hold
    for begin in np.arange(start, end - window, 0.5 * window):
        first, stop = np.searchsorted(speeds.time, [begin, begin + window])
        if stop - first < search.settings.min_inertia_samples:
            continue
        ratio = _ratio(speeds, int(first), int(stop) - 1)
        if np.ptp(np.percentile(ratio, [5, 95])) < _STEADY * np.median(ratio):
            return float(np.median(ratio))
    return None


def _usable(search: _Search, before: Run, after: Run) -> tuple[float, float]:
    """Times from and to which the two gears are held; clear of slip where a run was cut."""
    time, settle = search.speeds.time, search.settings.settle
    start = time[before.first] + (settle if before.first > 0 else 0.0)
    end = time[after.last] - (settle if after.last < len(time) - 1 else 0.0)
    return float(start), float(end)


def _gear_list(search: _Search) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in search.ratios.items())


def _torque_start(
    search: _Search, oncoming: str, earliest: float, phase: tuple[Boundary, Boundary]
) -> tuple[Boundary, tuple[str, ...]]:
    """Onset of the on-coming element's torque; with warnings where it is not what it should be.

    Where the on-coming element takes hold only after break-away (power-off upshift, power-on
    downshift) the torque phase before it is empty and starts at break-away.
    """
    begin, lock = phase
    earliest = max(earliest, begin.time - search.settings.max_torque_phase)
    role = f"pressure.{oncoming}"
    if role in search.log:
        pressure = smoothed(search.log[role], (earliest, lock.time))
        P0 = search.card.elements[oncoming].P0
        if not len(pressure.values):
            raise _NoShiftError(f"the pressure of {oncoming} is missing during the shift")
        if pressure.values.max() < P0.value - 3.0 * P0.std - pressure.noise:
            raise _NoShiftError(
                f"pressures contradict the speeds: {oncoming} locks, but its pressure reaches "
                f"only {pressure.values.max():.4g} Pa, below P0 = {P0.value:.4g} Pa"
            )
        onset = pressure_onset(pressure, (P0.value, P0.std), begin.time)
        if onset is not None and onset.time <= begin.time:
            return onset, ()
        when = "never" if onset is None else f"at {onset.time:.3f} s, after break-away"
        return begin, (f"{oncoming} exceeds P0 {when}: the torque phase is empty",)
    if "output_torque" in search.log:
        torque = smoothed(search.log["output_torque"], (earliest, begin.time))
        dip = torque_dip_onset(torque, begin.time)
        if dip is not None:
            return dip, (f"no pressure of {oncoming}: torque phase read from the output torque",)
    sigma = float(np.hypot(begin.sigma, search.settings.unknown_torque_phase))
    reason = f"no channel tells when {oncoming} takes up torque: torque phase set empty"
    return Boundary(begin.time, sigma), (reason,)


def _ratio_warnings(search: _Search, *runs: Run) -> tuple[str, ...]:
    """Say where the ratio held differs from the card's: rounded ratios, scaled speeds."""
    texts = []
    for run in runs:
        gear = run.gear or ""
        ratio = float(np.median(_ratio(search.speeds, run.first, run.last)))
        if abs(ratio / search.ratios[gear] - 1.0) > _RATIO_DRIFT:
            texts.append(
                f"ratio held in gear {gear} is {ratio:.5g}, the card says {search.ratios[gear]:.5g}"
            )
    return tuple(texts)


def _chain(shifts: list[Shift], settings: ShiftSettings) -> list[Shift]:
    """End each `after` where the next torque phase starts, begin each `before` after lock-up."""
    chained: list[Shift] = []
    for index, shift in enumerate(shifts):
        before, after = shift.before, shift.after
        if index > 0 and shifts[index - 1].lockup_time + settings.settle > before[0]:
            before = (min(shifts[index - 1].lockup_time + settings.settle, before[1]), before[1])
        if index + 1 < len(shifts):
            after = (after[0], min(after[1], shifts[index + 1].torque_phase[0]))
        chained.append(replace(shift, before=before, after=after))
    return chained
