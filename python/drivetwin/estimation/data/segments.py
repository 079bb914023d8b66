# SPDX-License-Identifier: MIT
"""Segments of a shift for the momentum balance, and gears that a log holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin._util.arrays import Span, compute_moving_mean
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import GearData, KnownDriveline, ShiftSignals
from drivetwin.estimation.regression.modulating_functions import Windows, build_windows
from drivetwin.likelihood.measured_signal import MeasuredSignal, prepare_signal
from drivetwin.shifts.detect import find_gear_spans, split_at_gaps
from drivetwin.shifts.lockup_clutch import CLOSED, LockUp, compute_mean_slip, detect_lock_ups
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue

SETTLED = 0.3
"""Left out after a lock-up [s]."""


def prepare_gears(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> tuple[GearData, ...]:
    """Prepare the gears engaged before and between the shifts, while the converter is closed.

    Without shifts all engaged gears of the log. Empty without an engine torque or output speed.
    """
    if not {"engine_torque", "output_speed"} <= log.channels.keys():
        return ()
    torque, speed = prepare_signal(log["engine_torque"]), prepare_signal(log["output_speed"])
    if shifts:
        spans = [(shifts[0].start_gear, shifts[0].before)]
        spans += [(s.end_gear, (s.lockup_time + SETTLED, s.after[1])) for s in shifts]
    else:
        spans = find_gear_spans(log, card)
    closings = detect_lock_ups(log, card)
    return tuple(
        GearData(
            gear,
            card.compute_ratio(gear),
            _trim_to_closed(log, card, closings, span),
            torque,
            speed,
        )
        for gear, span in spans
    )


def prepare_input_speed(log: ShiftLog) -> MeasuredSignal:
    """Return the gearbox input speed, or the engine speed in its place [rad/s]."""
    return prepare_signal(log["input_speed" if "input_speed" in log else "engine_speed"])


def _trim_to_closed(
    log: ShiftLog, card: VehicleCard, closings: Sequence[LockUp], span: Span
) -> Span:
    """Return the last part of `span` with the lock-up clutch closed, empty if there is none.

    A gearbox without a signal of the clutch is taken to have no converter.
    """
    for closing in reversed(closings):
        start, end = max(span[0], closing.time + SETTLED), min(span[1], closing.end)
        if end > start:
            return start, end
    slip = compute_mean_slip(log, card, span)
    open_all_along = bool(closings) or (slip is not None and abs(slip) > CLOSED)
    return (span[1], span[1]) if open_all_along else span


@dataclass(frozen=True)
class MomentumSettings:
    """Windows and priors of the momentum form; times in s.

    `width`, `step` of the Hann windows; in a phase shorter than two widths the window is
    `share` of the phase. `margin` keeps clear of lock and break-away. `delay_prior` is the
    plausible delay of an engine torque value on a CAN bus; `delay_grid` the delays scanned.
    """

    width: float = 0.4
    step: float = 0.025
    share: float = 0.4
    margin: float = 0.01
    delay_prior: PriorValue = field(default_factory=lambda: PriorValue(0.02, 0.03))
    delay_grid: tuple[float, ...] = tuple(np.linspace(-0.02, 0.08, 21).tolist())

    def compute_guard(self, boundary: str, shift: Shift) -> float:
        """Distance kept from a phase boundary [s]: the margin and three standard deviations."""
        return self.margin + 3.0 * shift.sigma.get(boundary, 0.0)


MOMENTUM = MomentumSettings()


@dataclass(frozen=True, eq=False)
class Segment:
    """Part of the log in which one momentum equation holds.

    `ratio` is i_g or i_h; `tied` is true if the gear is locked, so ω_e = ratio·ω_out.
    """

    ratio: float
    tied: bool
    windows: Windows


@dataclass(frozen=True)
class SegmentSettings:
    """Settings of the segments of a shift in which one momentum equation holds."""

    smooth: int = 5
    """Samples over which a pressure is averaged before it is compared with a limit [count]."""
    vented: float = 0.5
    """Pressure over P0 below which an element counts as empty after lock-up [ratio]."""
    min_span: float = 0.05
    """Shortest segment [s]; shorter ones contain no informative window."""
    min_beside_gap: float = 0.25
    """Shortest engaged gear beside a gap [s]: a delayed torque leaves no window there."""


SEGMENTS = SegmentSettings()


def find_off_going_release(
    signals: ShiftSignals, driveline: KnownDriveline, settings: MomentumSettings
) -> float:
    """First instant of the inertia phase at which the off-going element carries nothing [s].

    Its pressure must have fallen for good below P0, less two standard deviations of P0. Where P0
    is so little known, or so low, that no pressure is below that, it must have fallen to what is
    left of it after lock-up.
    """
    shift = signals.shift
    start = shift.inertia_phase[0] + settings.compute_guard("inertia_start", shift)
    element = driveline.offgoing
    pressure = signals.pressures[element.name]
    limit = element.P0.value - 2.0 * element.P0.std
    rest, margin = _estimate_vented_pressure(pressure, shift)
    if limit < rest + margin and rest < max(SEGMENTS.vented * element.P0.value, margin):
        limit = rest + margin
    smooth = compute_moving_mean(pressure.values, SEGMENTS.smooth)
    inside = (pressure.time >= start) & (pressure.time < shift.lockup_time)
    held = pressure.time[inside & (smooth >= limit)]
    return float(held[-1]) if held.size else start


def _estimate_vented_pressure(pressure: MeasuredSignal, shift: Shift) -> tuple[float, float]:
    """Residual off-going pressure after lock-up [Pa] and the tolerance for reaching it.

    The tolerance is the standard error of the mean plus a hundredth of the whole pressure drop.
    """
    spans = (np.linspace(*span, 100) for span in (shift.before, shift.after))
    before, rest = (float(np.median(pressure.interpolate_at_times(time))) for time in spans)
    return rest, 5.0 * pressure.sigma / float(np.sqrt(SEGMENTS.smooth)) + 0.01 * abs(before - rest)


def _select_driving_windows(torque: MeasuredSignal, windows: Windows) -> Windows:
    """The windows in which torque flows from engine to wheels throughout.

    Elsewhere the dissipative loss law has another efficiency (THEORY section 3). The output
    torque, averaged over 21 samples, must stay four standard errors above zero.
    """
    mean = compute_moving_mean(torque.values, 21)
    reversed_at = torque.time[mean < 4.0 * torque.sigma / np.sqrt(21.0)]
    first = np.searchsorted(reversed_at, windows.start)
    last = np.searchsorted(reversed_at, windows.start + windows.width)
    keep = first == last
    return Windows(windows.start[keep], windows.width[keep])


def find_segments(
    signals: ShiftSignals, driveline: KnownDriveline, settings: MomentumSettings
) -> tuple[Segment, ...]:
    """The stretches of a shift that carry an equation, with their windows."""
    shift = signals.shift
    lockup = settings.compute_guard("lockup", shift)
    free = find_off_going_release(signals, driveline, settings)
    spans = (
        (
            "before",
            (shift.before[0], shift.before[1] - settings.compute_guard("torque_start", shift)),
            True,
        ),
        ("inertia", (free, shift.lockup_time - lockup), False),
        ("after", (shift.lockup_time + lockup, shift.after[1]), True),
    )
    found, backwards = [], False
    for name, span, tied in spans:
        ratio = driveline.i_before if name == "before" else driveline.i_after
        for part in split_at_gaps(span, signals.output_gaps):
            if tied and part != span and part[1] - part[0] < SEGMENTS.min_beside_gap:
                continue
            windows = _build_span_windows(part, settings)
            if driveline.loss_law == "dissipative" and windows.count:
                windows = _select_driving_windows(signals.output_torque, windows)
                backwards = backwards or not windows.count
            if windows.count:
                found.append(Segment(ratio, tied, windows))
    if backwards and not found:
        raise IdentificationError(
            "nowhere does torque flow from the engine to the wheels throughout, which the momentum "
            "balance by the dissipative loss law needs",
            "use the likelihood method, or record a second with the pedal down close to the shift",
        )
    if not found:
        raise IdentificationError(
            "no stretch of the log is long enough for the momentum balance",
            "record at least 0.5 s before and after the shift",
        )
    return tuple(found)


def _build_span_windows(span: Span, settings: MomentumSettings) -> Windows:
    """Windows over a span, narrower ones where it is short; none below `min_span`."""
    length = span[1] - span[0]
    if length < SEGMENTS.min_span:
        return build_windows(span, np.inf, settings.step)
    short = length < 2.0 * settings.width
    width = settings.share * length if short else settings.width
    return build_windows(span, width, settings.step * width / settings.width)
