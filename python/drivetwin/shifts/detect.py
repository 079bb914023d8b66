# SPDX-License-Identifier: MIT
"""Shifts and their four phases from a log and a vehicle card (THEORY section 4).

A shift is trimmed to the span in which all inputs were recorded. A gap in the engine torque or in a
pressure cannot drive a model, so the gears before and after the shift are cut at it, and a shift
with a gap inside is rejected. A pressure gap matters only while an element may slip. It is ignored
if the pressure stays above or below P0 on both sides and the speeds are those of an engaged gear.
An input that starts after the gear before the shift, or ends before the gear after it, has a gap
there. So does the engine torque while the converter is open, because it does not drive the gearbox
then.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog, find_uncovered_ends
from drivetwin.channels.units import BAR
from drivetwin.errors import (
    DamagedChannelError,
    MissingChannelError,
    NoShiftError,
    TimeError,
    Where,
)
from drivetwin.findings import Code, Finding, report
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
from drivetwin.shifts.lockup_clutch import LETS_GO, TURBINE_TORQUE, check_flags, find_open_spans
from drivetwin.shifts.quality import compute_shift_quality
from drivetwin.shifts.shift import (
    RESTS,
    GearboxSpeeds,
    HeldRatio,
    RejectedShift,
    Shift,
    ShiftSettings,
    compute_gear_ratios,
    find_held_ratios,
    is_ratio,
    is_shared_pressure,
    resample_speeds,
)
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue

_EDGE = 0.2
"""Share of a gear held that is left out at both ends: there the pressures of a shift act."""
_APART = 0.5
"""Least difference of the pressure of an element between two gears, over its range, by which it
holds one of them and is open in the other."""

Levels = Mapping[str, float]
"""Median pressure [Pa] by gear held."""


def find_causes(log: ShiftLog, card: VehicleCard) -> tuple[Finding, ...]:
    """Find pressures that are exchanged in the mapping, and a card of another gearbox.

    Empty where the log has no two speeds.
    """
    if card.converter is not None and "input_speed" not in log:
        return ()
    try:
        speeds = resample_speeds(log, card)
    except (MissingChannelError, TimeError):
        return ()
    return (*_find_exchanged(log, card, speeds), *_find_other_gearbox(card, speeds))


def _find_exchanged(log: ShiftLog, card: VehicleCard, speeds: GearboxSpeeds) -> Iterator[Finding]:
    """Yield a finding for each two elements of which each is open in its own gears and closed in
    those of the other."""
    spans = _list_spans(card, speeds)
    names = [name for name in card.elements if make_pressure_role(name) in log]
    levels = {name: _measure_levels(log, name, spans) for name in names}
    for first, second in combinations(names, 2):
        own, others = (
            [
                gear.name
                for gear in card.gears
                if gear.name in spans and one in gear.elements and other not in gear.elements
            ]
            for one, other in ((first, second), (second, first))
        )
        if not own or not others or is_shared_pressure(log, first, second):
            continue
        low, high = levels[first], levels[second]
        if _is_lower(log, first, low, own, others) and _is_lower(log, second, high, others, own):
            gear = own[0]
            shown = {"open": low[gear] / BAR, "closed": high[gear] / BAR}
            names_ = {"first": first, "second": second, "gear": gear}
            yield report(Code.PRESSURES_EXCHANGED, **names_, **shown)


def _list_spans(card: VehicleCard, speeds: GearboxSpeeds) -> dict[str, list[Span]]:
    """Inner spans [s] of the gears held, by gear."""
    spans: dict[str, list[Span]] = {}
    for run in detect_gear_runs(speeds, compute_gear_ratios(card), ShiftSettings()):
        if run.gear is not None:
            start, end = float(speeds.time[run.first]), float(speeds.time[run.last])
            edge = _EDGE * (end - start)
            spans.setdefault(run.gear, []).append((start + edge, end - edge))
    return spans


def _measure_levels(
    log: ShiftLog, element: str, spans: Mapping[str, list[Span]]
) -> dict[str, float]:
    channel = log.get_pressure(element)
    found = {}
    for gear, each in spans.items():
        inside = np.zeros(channel.time.size, np.bool_)
        for low, high in each:
            inside |= (channel.time >= low) & (channel.time <= high)
        known = channel.values[inside & np.isfinite(channel.values)]
        found[gear] = float(np.median(known)) if known.size else float("nan")
    return found


def _is_lower(
    log: ShiftLog, element: str, levels: Levels, own: list[str], others: list[str]
) -> bool:
    """Return True if an element has less pressure in its own gears than in those of another."""
    extent = float(np.ptp(log.get_pressure(element).values))
    return min(levels[one] for one in others) - max(levels[one] for one in own) > _APART * extent


def _find_other_gearbox(card: VehicleCard, speeds: GearboxSpeeds) -> list[Finding]:
    """Report all ratios that rest for `RESTS` and are on no gear of the card, in one finding."""
    found = [
        one
        for one in find_held_ratios(speeds, RESTS)
        if not any(is_ratio(one, gear.ratio) for gear in card.gears)
    ]
    return report_unknown_ratios(found, compute_gear_ratios(card))


def report_unknown_ratios(found: list[HeldRatio], ratios: Mapping[str, float]) -> list[Finding]:
    """Report the ratios that are `found` on no gear of the card, in one finding; empty without."""
    if not found:
        return []
    rests = ", ".join(f"{one.ratio:.4g} for {one.time:.1f} s" for one in found)
    gears = ", ".join(f"{name} {ratio:.4g}" for name, ratio in ratios.items())
    return [report(Code.RATIO_UNKNOWN, ratios=rests, gears=gears)]


OLDEST, YOUNGEST = 0.08, 0.02
"""A stamp of the engine torque shows an instant so much earlier at most, or so much later [s]."""

LEAST = 0.15
"""Shortest usable time [s] of an engaged gear before and after the shift."""

BEFORE, AFTER = 8.0, 5.0
"""Longest time [s] of the gears held before and after the shift over which a load is taken as
constant: on a drive grade and service brake change it."""


def split_at_gaps(span: Span, gaps: tuple[Span, ...]) -> tuple[Span, ...]:
    """The parts of `span` [s] that no gap touches, in order of time."""
    parts, start = [], span[0]
    for low, high in sorted(gaps):
        if high <= start or low >= span[1]:
            continue
        if low > start:
            parts.append((start, low))
        start = max(start, high)
    if start < span[1]:
        parts.append((start, span[1]))
    return tuple(parts)


@dataclass(frozen=True, eq=False)
class _Gap:
    """A gap [s] of one channel, and the `reach` of what it leaves unknown.

    Without a channel it is the converter that is open.
    """

    channel: Channel | None
    span: Span
    reach: Span

    def __str__(self) -> str:
        low, high = self.span
        if self.channel is None:
            return f"the converter is open from {low:.3f} s to {high:.3f} s"
        return f"{self.channel.source_name!r} has no samples from {low:.3f} s to {high:.3f} s"


def trim_to_window(shift: Shift, most: tuple[float, float] = (BEFORE, AFTER)) -> Shift:
    """Return `shift` with no more of the gears before and after it than `most` [s].

    Unless stated, that is what one load holds for.
    """
    before = max(shift.before[0], shift.before[1] - most[0]), shift.before[1]
    after = shift.after[0], min(shift.after[1], shift.after[0] + most[1])
    if (before, after) == (shift.before, shift.after):
        return shift
    return replace(shift, before=before, after=after)


def trim_to_recorded(
    log: ShiftLog, shift: Shift, fills: Mapping[str, PriorValue], i_in: float = 1.0
) -> Shift:
    """Return `shift` with `before` and `after` cut to what its inputs were recorded for.

    `fills` is P0 [Pa] of both elements by name, `i_in` the ratio of the input gear. A cut is
    reported in the findings of the shift. Raises DamagedChannelError where a gap lies in the shift
    itself or leaves less than LEAST of a gear.
    """
    gaps = _find_gaps(log, shift, fills)
    gaps += [
        _Gap(None, span, (span[0] - LETS_GO, span[1] + LETS_GO))
        for span in find_open_spans(log, i_in)
    ]
    start, end = shift.before[1], shift.lockup_time
    inside = [gap for gap in gaps if gap.reach[0] < end and gap.reach[1] > start]
    if inside:
        raise _make_gap_error(log, inside[0], "during the shift")
    earlier = [gap for gap in gaps if shift.before[0] < gap.reach[1] <= start]
    if earlier:
        last = max(earlier, key=lambda gap: gap.reach[1])
        if start - last.reach[1] < LEAST:
            raise _make_gap_error(log, last, f"less than {LEAST:g} s before the shift")
        cut = report(Code.BEFORE_CUT, gap=str(last), gear=shift.start_gear)
        shift = replace(shift, before=(last.reach[1], start), findings=(*shift.findings, cut))
    later = [gap for gap in gaps if end <= gap.reach[0] < shift.after[1]]
    if later:
        first = min(later, key=lambda gap: gap.reach[0])
        if first.reach[0] - end < LEAST:
            raise _make_gap_error(log, first, f"less than {LEAST:g} s after the shift")
        cut = report(Code.AFTER_CUT, gap=str(first), gear=shift.end_gear)
        after = (shift.after[0], first.reach[0])
        shift = replace(shift, after=after, findings=(*shift.findings, cut))
    return shift


def _find_gaps(log: ShiftLog, shift: Shift, fills: Mapping[str, PriorValue]) -> list[_Gap]:
    """Gaps of the inputs that matter to the shift, where they start late or end early too."""
    found = []
    whole = (shift.before[0], shift.after[1])
    if "engine_torque" in log:
        torque = log["engine_torque"].updates
        gaps = (*torque.gaps, *find_uncovered_ends(torque.time, whole))
        found += [_Gap(torque, gap, (gap[0] - OLDEST, gap[1] + YOUNGEST)) for gap in gaps]
    for name, fill in fills.items():
        if make_pressure_role(name) in log:
            pressure = log.get_pressure(name)
            inner = [gap for gap in pressure.gaps if _is_relevant_gap(pressure, gap, shift, fill)]
            gaps = (*inner, *find_uncovered_ends(pressure.time, whole))
            found += [_Gap(pressure, gap, gap) for gap in gaps]
    return found


def _is_relevant_gap(pressure: Channel, gap: Span, shift: Shift, fill: PriorValue) -> bool:
    """Return True if an element may have started to transmit torque, or to slip, in a gap."""
    if gap[1] > shift.before[1] and gap[0] < shift.lockup_time:
        return True
    beside = np.interp(gap, pressure.time, pressure.values) - fill.value
    return bool(np.sign(beside[0]) != np.sign(beside[1]) or np.abs(beside).min() < fill.std)


def _make_gap_error(log: ShiftLog, gap: _Gap, where: str) -> DamagedChannelError:
    if gap.channel is None:
        return DamagedChannelError(
            f"{gap}, {where}: the engine torque does not drive the gearbox there",
            "state the map of the converter as [converter] on the card, or record the shift with "
            "the lock-up clutch closed",
            Where(file=log.source, time=gap.span[0]),
        )
    again = "record the shift again: what drives a model must be there throughout"
    if gap.channel.source_name.startswith(TURBINE_TORQUE):
        again = (
            "keep the lock-up clutch open, or closed, from a second before the shift to a second "
            "after it; where it was open at the same speeds on both sides, map its flag as "
            "'lockup_engaged'"
        )
    return DamagedChannelError(
        f"{gap}, {where}",
        again,
        Where(file=log.source, channel=gap.channel.source_name, time=gap.span[0]),
    )


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
            rejected.append(RejectedShift(span, *no_shift.args))
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

    The remedy is that of a cause in the card or the channel mapping, else of a candidate.
    """
    if found.shifts:
        return
    causes = find_causes(log, card)
    reasons = "; ".join(
        [one.cause.rstrip(".") for one in causes]
        + [f"{one.time[0]:.3f} s to {one.time[1]:.3f} s: {one.reason}" for one in found.rejected]
    )
    remedies = [*(one.remedy for one in causes), *(one.remedy for one in found.rejected)]
    raise NoShiftError(
        f"no usable gear shift; {reasons}" if reasons else "no gear shift: one gear throughout",
        next(filter(None, remedies), "")
        or "record from a second before the torque phase to a second after lock-up; "
        "check the ratios on the card and the speed channels with 'drivetwin inspect'",
        Where(file=log.source),
    )
