# SPDX-License-Identifier: MIT
"""Check of the detected shifts against the shift flag and gear of the transmission."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import Span, find_true_runs
from drivetwin.channels.shiftlog import Channel, ShiftLog, find_uncovered_ends
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.shifts.shift import RejectedShift, Shift

_GLITCH = 0.05
"""A flag that changes for a shorter time [s] than this was sent wrongly, or by another sender."""

_LATE = 0.3
"""Largest delay [s] of a gear or flag on the bus."""


def find_flag_spans(flag: Channel) -> tuple[Span, ...]:
    """Spans [s] in which a flag is set, from its first to its last set sample.

    A change for less than _GLITCH is none.
    """
    on, ends = flag.values > 0.5, np.append(flag.time, flag.time[-1] + flag.step)
    for state in (False, True):
        for first, stop in find_true_runs(on == state):
            inside = first > 0 and stop < on.size
            if inside and ends[stop] - ends[first] < _GLITCH:
                on[first:stop] = not state
    return tuple(
        (float(flag.time[first]), float(flag.time[stop - 1])) for first, stop in find_true_runs(on)
    )


def find_flag_start(log: ShiftLog, time: float, reach: float) -> float | None:
    """Return the time [s] of setting of the shift flag at `time`, at most `reach` earlier."""
    if "shift_in_process" not in log:
        return None
    found = [low for low, high in find_flag_spans(log["shift_in_process"]) if low <= time <= high]
    return found[0] if found and time - found[0] <= reach else None


def check_flags(
    log: ShiftLog, shifts: Sequence[Shift], rejected: Sequence[RejectedShift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """The shifts with a finding where flag or gear contradict them, and flags without a shift."""
    flag = log.channels.get("shift_in_process")
    spans = None if flag is None else find_flag_spans(flag)
    found = tuple(
        replace(s, findings=(*s.findings, *_find_contradictions(log, s, spans))) for s in shifts
    )
    if flag is None or spans is None:
        return found, tuple(rejected)
    seen = [(s.torque_phase[0], s.lockup_time) for s in shifts] + [r.time for r in rejected]
    empty = [
        RejectedShift(span, _explain_missing_shift(log, flag, span))
        for span in spans
        if not any(low <= span[1] and high >= span[0] for low, high in seen)
    ]
    return found, (*rejected, *empty)


def _explain_missing_shift(log: ShiftLog, flag: Channel, span: Span) -> str:
    """Explain why a flag set over `span` [s] has no shift."""
    if span[0] <= flag.time[0]:
        return "the shift flag is set where the recording begins: the shift is not all in it"
    if span[1] >= flag.time[-1]:
        return "the shift flag is set where the recording ends: the shift is not all in it"
    for role, substitute in (("input_speed", "engine_speed"), ("output_speed", "wheel_speed")):
        speed = log[role if role in log else substitute]
        for low, high in (*speed.gaps, *find_uncovered_ends(speed.time, span)):
            if low < span[1] and high > span[0]:
                missing = f"{speed.source_name!r} has no samples from {low:.3f} s to {high:.3f} s"
                return f"the shift flag is set, but {missing}: no change of gear can be seen"
    return "the shift flag is set, but the speeds show no change of gear"


def _find_contradictions(
    log: ShiftLog, shift: Shift, flags: Sequence[Span] | None
) -> list[Finding]:
    """Findings where the flag, set over `flags` (None: not in the log), or the gear differ."""
    findings = []
    if flags is not None:
        start, end = shift.inertia_phase
        if not any(low <= start + _LATE and high >= end - _LATE for low, high in flags):
            findings.append(report(Code.SHIFT_FLAG_NOT_SET))
    if "gear" in log:
        gear = log["gear"]
        moments = (
            (shift.start_gear, shift.inertia_phase[0]),
            (shift.end_gear, min(shift.lockup_time + _LATE, shift.after[1])),
        )
        for name, time in moments:
            value = float(gear.interpolate(np.array([time]))[0])
            if name.isdecimal() and np.isfinite(value) and value != float(name):
                shown = {"value": Number(value), "time": Number(time, "s")}
                findings.append(report(Code.GEAR_SIGNAL_DIFFERS, gear=name, **shown))
    return findings
