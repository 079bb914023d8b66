# SPDX-License-Identifier: MIT
"""The converter's lock-up clutch: closings, open spans, state during a shift; flags of a control.

With the clutch open the gearbox is driven by the turbine; a map gives its torque from both speeds.
Closed means ω_e = i_in·ω_in. The flag on the bus gives the time; the speeds must confirm it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, Span, compute_moving_mean, find_true_runs
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog, find_uncovered_ends
from drivetwin.errors import IdentificationError, Where
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.card import VehicleCard

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


BoolArray = NDArray[np.bool_]

TURBINE_TORQUE = "turbine torque"
"""Prefix of the source name of a turbine torque computed from the converter map."""

CLOSED = 0.02
"""Relative slip between engine and input below which the lock-up clutch counts as closed."""
_RIGID = 0.005
"""Bound like `CLOSED`, for logs without a signal that separates lock-up from a passing through
synchronism of an open converter."""
_HOLD = 0.3
"""Time [s] over which the slip must stay closed."""
_LASTS = 1.0
"""Time [s] from which on slip is no late speed in a shift."""
LETS_GO = 0.3
"""Time [s] before the converter is seen open or closed, and after it is, in which its lock-up
clutch may slip."""
_BEYOND = 0.01
"""Speed ratio by which noise may lead beyond the ends of a map."""
_BESIDE = 0.5
"""Span before a shift [s] over which its converter is looked at."""
_STEP = 0.01
"""Raster [s] on which slip is looked at."""


@dataclass(frozen=True)
class LockUp:
    """The lock-up clutch closes at `time` ± `sigma` [s] and stays so until `end` [s].

    `warning` describes a contradiction between flag and speeds; empty without one.
    """

    time: float
    sigma: float
    end: float
    warning: str = ""


def compute_mean_slip(log: ShiftLog, card: VehicleCard, span: Span) -> float | None:
    """Mean of ω_e/(i_in·ω_in) - 1 over `span` [s]; None without the channels."""
    if "engine_speed" not in log or "input_speed" not in log:
        return None
    engine = log["engine_speed"]
    inside = (engine.time >= span[0]) & (engine.time <= span[1])
    inlet = card.i_in.value * log["input_speed"].interpolate(engine.time[inside])
    known = np.isfinite(inlet) & (inlet > 0.0)
    if not known.any():
        return None
    return float(np.mean(engine.values[inside][known] / inlet[known])) - 1.0


def compute_converter_slip(log: ShiftLog, card: VehicleCard, shift: Shift) -> float | None:
    """Slip of the converter before `shift`; None if closed or without the channels."""
    slip = compute_mean_slip(log, card, (shift.before[1] - _BESIDE, shift.before[1]))
    return slip if slip is not None and abs(slip) > CLOSED else None


def check_lockup_observed(log: ShiftLog, card: VehicleCard) -> tuple[Finding, ...]:
    """Return a finding if the card has a converter and no channel indicates whether it is open."""
    lacks = [role for role in ("engine_speed", "input_speed") if role not in log]
    if card.converter is None or not lacks or "lockup_engaged" in log:
        return ()
    return (report(Code.LOCKUP_UNKNOWN, channel=lacks[0]),)


def refer_to_turbine(log: ShiftLog, card: VehicleCard, shift: Shift) -> ShiftLog:
    """Replace the engine by the turbine as the input of the gearbox if the converter is open.

    Its torque, by the card's map from the speeds of engine and input, takes the place of
    `engine_torque`, and its speed that of the engine. It has no samples where the lock-up clutch
    may carry some of it, nor beyond the ends of the map. The log as it is where the converter is
    closed before `shift` or the card has no map. Raises IdentificationError where the map ends
    short of the shift.
    """
    if card.converter is None or compute_converter_slip(log, card, shift) is None:
        return log
    engine = log["engine_speed"].updates
    turbine = card.i_in.value * log["input_speed"].updates.interpolate(engine.time)
    known = np.isfinite(turbine) & (engine.values > 0.0)
    ratio = np.divide(turbine, engine.values, out=np.zeros_like(turbine), where=known)
    first, last = card.converter.speed_ratio[0], card.converter.speed_ratio[-1]
    beyond = known & ((ratio < first - _BEYOND) | (ratio > last + _BEYOND))
    _require_map(log, shift, engine.time[beyond], ratio[beyond], (first, last))
    known &= ~beyond
    for start, end in _find_closed_spans(log, card.i_in.value):
        known &= (engine.time < start - LETS_GO) | (engine.time > end + LETS_GO)
    torque = Channel(
        role="engine_torque",
        quantity=Quantity.TORQUE,
        time=engine.time[known],
        values=card.converter.compute_turbine_torque(engine.values[known], turbine[known]),
        source_name=f"{TURBINE_TORQUE} from {engine.source_name}, lock-up clutch open",
        source_unit="Nm",
    )
    others = {role: c for role, c in log.channels.items() if role != "engine_speed"}
    return replace(log, channels={**others, "engine_torque": torque})


def _require_map(
    log: ShiftLog, shift: Shift, time: FloatArray, ratio: FloatArray, ends: Span
) -> None:
    """Raise IdentificationError where speed ratios (n,) beyond the `ends` of the map, at `time`
    (n,) [s], lie in the shift or just beside it."""
    near = (time > shift.before[1] - _HOLD) & (time < shift.lockup_time + _HOLD)
    if not near.any():
        return
    worst = ratio[near][np.argmax(np.maximum(ends[0] - ratio[near], ratio[near] - ends[1]))]
    raise IdentificationError(
        f"the map of the converter on the card has speed ratios from {ends[0]:g} to {ends[1]:g}; "
        f"in the shift {shift.start_gear}-{shift.end_gear} it is {worst:.3f}",
        "give the map under [converter] as far as the log goes; in overrun the turbine is faster "
        "than the pump, which is a ratio above 1",
        Where(file=log.source, time=float(time[near][0])),
    )


def _find_closed_spans(log: ShiftLog, i_in: float) -> tuple[Span, ...]:
    """Spans [s] in which the lock-up clutch is closed: by its flag, else by the speeds of engine
    and input, the same for _HOLD on. An open converter seldom lingers there, and carries nothing.
    """
    if "lockup_engaged" in log:
        return tuple(find_flag_spans(log["lockup_engaged"]))
    return _find_slip_spans(log, i_in, lambda mean: np.abs(mean) < _RIGID, _HOLD)


def require_locked_converter(log: ShiftLog, card: VehicleCard, shift: Shift) -> None:
    """Raise IdentificationError where the converter slips before `shift` and has no map.

    Its torque would have to be known then; the engine torque is not that of the gearbox.
    """
    slip = compute_converter_slip(log, card, shift)
    if slip is not None and card.converter is None:
        raise IdentificationError(
            f"the converter is open before the shift {shift.start_gear}-{shift.end_gear}: engine "
            f"and gearbox input differ by {100.0 * slip:.1f} %",
            "state the map of the converter as [converter] on the card, or record the shift with "
            "the lock-up clutch closed; see phases and speeds of this one with "
            "'drivetwin shifts'",
            Where(file=log.source, time=shift.before[1]),
        )


def detect_lock_ups(log: ShiftLog, card: VehicleCard) -> tuple[LockUp, ...]:
    """Every closing of the lock-up clutch; one that is closed from the first sample on is none."""
    if "lockup_engaged" in log:
        flag = log["lockup_engaged"]
        return tuple(
            _check_flag_closing(log, card, flag, span)
            for span in find_flag_spans(flag)
            if span[0] > flag.time[0]
        )
    if "engine_speed" in log and "input_speed" in log:
        return _detect_closings(log["engine_speed"], log["input_speed"], card.i_in.value)
    return ()


def _check_flag_closing(log: ShiftLog, card: VehicleCard, flag: Channel, span: Span) -> LockUp:
    """Closing according to the flag, checked against the slip."""
    slip = compute_mean_slip(log, card, (span[0] + _HOLD, max(span[1], span[0] + 2.0 * _HOLD)))
    warning = ""
    if slip is None:
        warning = "no speeds of engine and input: the flag is unchecked"
    elif abs(slip) > CLOSED:
        warning = f"the flag indicates lock-up, but engine and input differ by {100 * slip:.1f} %"
    return LockUp(span[0], flag.step / float(np.sqrt(12.0)), span[1], warning)


def _detect_closings(engine: Channel, inlet: Channel, i_in: float) -> tuple[LockUp, ...]:
    """Find closings from the speeds: the slip, averaged over _HOLD/3, rests at zero for _HOLD.

    Slip has to be present for as long before.
    """
    time, slip = _compute_slip(engine, inlet, i_in)
    width = round(_HOLD / _STEP / 3.0)
    if time.size < 4 * width:
        return ()
    mean = compute_moving_mean(np.where(np.isfinite(slip), slip, 1.0), width)
    closed = np.abs(mean) < CLOSED
    for first, stop in find_true_runs(~closed):
        # A late engine speed looks like slip while a shift changes the speeds.
        if first > 0 and (stop - first) * _STEP < _HOLD:
            closed[first:stop] = True
    return tuple(
        LockUp(float(time[first]), _HOLD / 6.0, float(time[stop - 1]))
        for first, stop in find_true_runs(closed)
        if (stop - first) * _STEP >= _HOLD and first > width
    )


def find_open_spans(log: ShiftLog, i_in: float) -> tuple[Span, ...]:
    """Spans [s] in which the speeds of engine and input show the converter open, for _LASTS on.

    Less may be a late engine speed while a shift changes the speeds. Empty where the log lacks one
    of the speeds, as one does that sees the turbine as its engine.
    """
    if "engine_speed" not in log or "input_speed" not in log:
        return ()
    return _find_slip_spans(log, i_in, lambda mean: np.abs(mean) > CLOSED, _LASTS)


def _find_slip_spans(
    log: ShiftLog, i_in: float, shows: Callable[[FloatArray], BoolArray], least: float
) -> tuple[Span, ...]:
    """Spans [s] of `least` or more in which the slip's mean over _HOLD/3 `shows` something."""
    time, slip = _compute_slip(log["engine_speed"], log["input_speed"], i_in)
    width = round(_HOLD / _STEP / 3.0)
    if time.size < 4 * width:
        return ()
    mean = compute_moving_mean(np.where(np.isfinite(slip), slip, 0.0), width)
    return tuple(
        (float(time[first]), float(time[stop - 1]))
        for first, stop in find_true_runs(shows(mean))
        if (stop - first) * _STEP >= least
    )


def _compute_slip(engine: Channel, inlet: Channel, i_in: float) -> tuple[FloatArray, FloatArray]:
    """ω_e/(i_in·ω_in) - 1 (n,) at times (n,) [s] every _STEP that both speeds share.

    Not finite in a gap and where the input stands.
    """
    start, end = max(engine.time[0], inlet.time[0]), min(engine.time[-1], inlet.time[-1])
    time = np.arange(start, end, _STEP)
    with np.errstate(divide="ignore", invalid="ignore"):
        return time, engine.interpolate(time) / (i_in * inlet.interpolate(time)) - 1.0
