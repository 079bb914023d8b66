# SPDX-License-Identifier: MIT
"""Preparation of engaged gears, for estimates that need no shift."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.arrays import Span
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.shift_data import GearData, MeasuredSignal
from drivetwin.shifts.detect import find_gear_spans
from drivetwin.shifts.lockup_clutch import CLOSED, LockUp, compute_mean_slip, detect_lock_ups
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.vehicle_card import VehicleCard

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
