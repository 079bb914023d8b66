# SPDX-License-Identifier: MIT
"""Shifts and their four phases from a log and a vehicle card (THEORY section 4)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from drivetwin._util.arrays import FloatArray
from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import NoShiftError, Where
from drivetwin.shifts.candidate import (
    CandidateRefusedError,
    Run,
    Search,
    build_shift,
    compute_ratio,
    describe_gears,
    detect_gear_runs,
    find_resting_ratio,
)
from drivetwin.shifts.coverage import find_causes
from drivetwin.shifts.lockup_clutch import check_flags
from drivetwin.shifts.quality import compute_shift_quality
from drivetwin.shifts.shift import (
    GearboxSpeeds,
    RejectedShift,
    Shift,
    ShiftSettings,
    compute_gear_ratios,
    resample_speeds,
)
from drivetwin.vehicle.vehicle_card import VehicleCard


class FoundShifts(NamedTuple):
    """Usable shifts and rejected candidates of a log, both in order of time."""

    shifts: tuple[Shift, ...]
    rejected: tuple[RejectedShift, ...]

    def __repr__(self) -> str:
        """Name the shifts with the time [s] of lock-up; the default lists every number of all."""
        named = (f"{one.name} at {one.lockup_time:.2f} s" for one in self.shifts)
        return f"<FoundShifts: {', '.join(named) or 'none'}; {len(self.rejected)} rejected>"


@check_arguments
def detect_shifts(
    log: ShiftLog, card: VehicleCard, settings: ShiftSettings | None = None
) -> FoundShifts:
    """Find every gear shift of a log, its phases and quality figures, and the candidates refused.

    A gear is held where ω_in = ic·iout·ω_out (zero slip, eq. 15, of the element that makes it).
    Between two gears held, the inertia phase runs from the hinge at which the off-going slip
    leaves zero to the one at which the on-coming slip reaches it; the torque phase precedes it,
    from the on-coming pressure's crossing of P0 (without it: from the fall of the output torque,
    or halfway from the shift flag). Flag and gear of the bus are checked against the speeds.
    Raises MissingChannelError where a speed is missing, TimeError where the speeds share no time.
    """
    speeds = resample_speeds(log, card)
    search = Search(log, card, speeds, compute_gear_ratios(card), settings or ShiftSettings())
    runs = detect_gear_runs(speeds, search.ratios, search.settings)
    if not runs:
        return FoundShifts((), (_find_standstill(search),))
    shifts: list[Shift] = []
    rejected = [
        RejectedShift(_to_span(speeds, run), reason)
        for index, run in enumerate(runs)
        if (reason := _explain_no_shift(search, runs, index))
    ]
    held = _drop_passing_gears(
        [run for run in runs if run.gear is not None], speeds.time, search.settings
    )
    for before, after in pairwise(held):
        if _has_standstill(runs, before, after):
            continue
        try:
            shifts.append(build_shift(search, before, after))
        except CandidateRefusedError as no_shift:
            span = (float(speeds.time[before.last]), float(speeds.time[after.first]))
            rejected.append(RejectedShift(span, str(no_shift)))
    chained = _limit_phases(shifts, search.settings)
    rated = tuple(
        replace(one, quality=compute_shift_quality(log, card, one, speeds=speeds))
        for one in chained
    )
    finished, refused = check_flags(log, rated, rejected)
    return FoundShifts(finished, tuple(sorted(refused, key=lambda item: item.time)))


def find_gear_spans(log: ShiftLog, card: VehicleCard) -> list[tuple[str, tuple[float, float]]]:
    """The gears that a log holds, in order of time, with first and last time [s] of each.

    Raises as `detect_shifts`.
    """
    speeds = resample_speeds(log, card)
    runs = detect_gear_runs(speeds, compute_gear_ratios(card), ShiftSettings())
    return [(run.gear, _to_span(speeds, run)) for run in runs if run.gear is not None]


def _find_standstill(search: Search) -> RejectedShift:
    speeds = search.speeds
    return RejectedShift(
        (float(speeds.time[0]), float(speeds.time[-1])),
        f"the output speed is never above {search.settings.min_output_speed:g} rad/s "
        f"(highest {speeds.output.max():.4g} rad/s): standstill, or the wrong sign or unit",
    )


def _to_span(speeds: GearboxSpeeds, run: Run) -> tuple[float, float]:
    return float(speeds.time[run.first]), float(speeds.time[run.last])


def _has_standstill(runs: list[Run], before: Run, after: Run) -> bool:
    """Return True if the vehicle stood still between two engaged gears."""
    between = [run for run in runs if before.last < run.first and run.last < after.first]
    missing = (after.first - before.last - 1) - sum(run.last - run.first + 1 for run in between)
    return missing > 0


def _drop_passing_gears(held: list[Run], time: FloatArray, settings: ShiftSettings) -> list[Run]:
    """Without gears that are passed once more on the way to another: a slip that first turned."""
    return [
        run
        for before, run, after in zip([None, *held], held, [*held[1:], None], strict=False)
        if before is None
        or after is None
        or before.gear != run.gear
        or after.gear == run.gear
        or time[run.last] - time[run.first] > 2.0 * settings.min_hold
        or time[after.first] - time[before.last] > settings.max_inertia_phase
    ]


def _explain_no_shift(search: Search, runs: list[Run], index: int) -> str:
    """Why a stretch without gear belongs to no shift with a gear on either side; empty if none."""
    run, speeds = runs[index], search.speeds
    if run.gear is not None:
        return ""
    before = runs[index - 1] if index > 0 else None
    after = runs[index + 1] if index + 1 < len(runs) else None
    if before is not None and _has_standstill(runs, before, run):
        before = None
    if after is not None and _has_standstill(runs, run, after):
        after = None
    start, end = _to_span(speeds, run)
    if end - start < search.settings.min_hold or (before and after):
        return ""
    ratio = compute_ratio(speeds, run.first, run.last)
    measured = f"measured ratio {ratio.min():.4g} to {ratio.max():.4g}"
    resting = find_resting_ratio(search, start, end)
    if resting is not None:
        return f"steady ratio {resting:.4g} matches no gear of the card ({describe_gears(search)})"
    if before is None and after is None:
        return f"no gear of the card is held; {measured}"
    if before is None:
        return f"no gear is held before gear {after.gear if after else ''}; {measured}"
    return (
        f"the on-coming element does not lock: after gear {before.gear} the slip is zero in no "
        f"gear until the recording or the motion ends; {measured}"
    )


def _limit_phases(shifts: list[Shift], settings: ShiftSettings) -> list[Shift]:
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


def require_shifts(log: ShiftLog, card: VehicleCard) -> FoundShifts:
    """Detect shifts like `detect_shifts`; raise NoShiftError with the rejections if all are."""
    found = detect_shifts(log, card)
    refuse_without_shifts(log, card, found)
    return found


def refuse_without_shifts(log: ShiftLog, card: VehicleCard, found: FoundShifts) -> None:
    """Raise NoShiftError with the rejected candidates if no shift was found.

    A cause in the card or the channel mapping comes first, with its remedy.
    """
    if found.shifts:
        return
    causes = find_causes(log, card)
    reasons = "; ".join(
        [one.cause.rstrip(".") for one in causes]
        + [f"{one.time[0]:.3f} s to {one.time[1]:.3f} s: {one.reason}" for one in found.rejected]
    )
    raise NoShiftError(
        f"no usable gear shift; {reasons}" if reasons else "no gear shift: one gear throughout",
        causes[0].remedy
        if causes
        else "record from a second before the torque phase to a second after lock-up; "
        "check the ratios on the card and the speed channels with 'drivetwin inspect'",
        Where(file=log.source),
    )
