# SPDX-License-Identifier: MIT
"""Selection of the shifts of a whole drive that are fitted.

On a road the driver brakes and the slope changes, and no channel records either. A shift with a
varying load biases the fit of all others, so it is dropped if enough other shifts remain. Beyond
MOST shifts the sensor tolerances dominate the intervals, while time and memory of a fit still
grow. For each gear change, the shifts with the smallest load residual are therefore used first.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.progress import tell
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DamagedChannelError, IdentificationError
from drivetwin.estimation.data.load_stationarity import own_load, vehicle_of
from drivetwin.estimation.data.prepare import BESIDE, sampled
from drivetwin.estimation.data.segments import MomentumSettings, stretches
from drivetwin.estimation.data.shift_data import Driveline, ShiftSignals
from drivetwin.shifts.coverage import near, recorded
from drivetwin.shifts.lockup_clutch import behind_converter, open_slip, require_closed
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.vehicle_card import VehicleCard

MOST = 12
"""Most shifts of one log in one fit."""
CONSTANT = 5.0
"""Noise power left by eq. 11 up to which a load counts as constant, over that of the best shift:
braked ones and those over a change of grade leave 30 to 10000 times as much, others 0.7 to 1.5
times. That of the best is 1, or what a delay of the sensors makes of it, which is the same in all.
"""


def usable_of(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """The shifts that can be used, cut to what a model may be driven over, and those refused.

    Refused for a gap, for an open converter without a map, and for one with a map where other
    shifts of the log have it closed: the inertia on the engine's side is another. Where none is
    left, the last refusal is raised (DamagedChannelError, IdentificationError).
    """
    usable: list[Shift] = []
    refused: list[RejectedShift] = []
    for shift in shifts:
        fills = {name: card.element(name).P0 for name in (shift.offgoing, shift.oncoming)}
        try:
            require_closed(log, card, shift)
            seen = behind_converter(log, card, shift)
            usable.append(near(recorded(seen, shift, fills, card.i_in)))
        except (DamagedChannelError, IdentificationError) as refusal:
            if len(shifts) == len(refused) + 1:
                raise
            span = (shift.before[1], shift.lockup_time)
            refused.append(RejectedShift(span, refusal.what))
    closed = tuple(shift for shift in usable if open_slip(log, card, shift) is None)
    if not closed:
        return tuple(usable), tuple(refused)
    refused += [
        RejectedShift((shift.before[1], shift.lockup_time), "the converter is open in this shift")
        for shift in usable
        if shift not in closed
    ]
    return closed, tuple(refused)


def balanced(
    signals: list[ShiftSignals], drivelines: list[Driveline]
) -> tuple[list[ShiftSignals], list[Driveline], tuple[RejectedShift, ...]]:
    """The shifts from which a fit can start, and those left out with the reason.

    All where there would be none: in overrun the dissipative law leaves no momentum balance.
    """
    kept, refused = [], []
    for k, (one, driveline) in enumerate(zip(signals, drivelines, strict=True)):
        try:
            stretches(one, driveline, MomentumSettings())
        except IdentificationError as fault:
            span = (one.shift.before[1], one.shift.lockup_time)
            refused.append(RejectedShift(span, f"{fault.what}; other shifts of the log have one"))
        else:
            kept.append(k)
    if not kept:
        return signals, drivelines, ()
    return [signals[k] for k in kept], [drivelines[k] for k in kept], tuple(refused)


def chosen(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    """The shifts to be fitted, in order of time, and those left out with the reason.

    All where there is one only. Without an output torque nothing tells of the load.
    """
    if len(shifts) < 2:
        return tuple(shifts), ()
    left = _left(log, card, shifts)
    most = CONSTANT * max(1.0, min(left))
    steady = [k for k, power in enumerate(left) if power <= most]
    taken = sorted(_first(shifts, left, steady))
    refused = [
        RejectedShift((one.before[1], one.lockup_time), _reason(left[k], k in steady))
        for k, one in enumerate(shifts)
        if k not in taken
    ]
    return tuple(shifts[k] for k in taken), tuple(refused)


def _reason(left: float, steady: bool) -> str:
    if steady:
        return (
            f"not needed: {MOST} shifts of the log are fitted, of every change of gears those "
            "first whose load is the most constant; hold it out to see it predicted"
        )
    if not np.isfinite(left):
        return "the gears held beside it tell nothing of its load; other shifts of the log do"
    return (
        f"the load is not constant: the balance of the vehicle leaves {left:.3g} times its noise "
        "power, as where the brake is used or the grade changes; other shifts of the log do without"
    )


def _left(log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]) -> list[float]:
    """Noise power that the best constant load leaves of each shift, the vehicle being the same in
    all; infinite where a shift tells nothing of it, and 0 for all without an output torque."""
    if "output_torque" not in log:
        return [0.0] * len(shifts)
    torque = sampled(log["output_torque"])
    if "wheel_speed" in log:
        wheel = sampled(log["wheel_speed"])
    else:
        wheel = sampled(log["output_speed"], 1.0 / card.final_drive)
    spans = [(one.before[0], one.after[1]) for one in shifts]
    near = [(start - BESIDE, end + BESIDE) for start, end in spans]
    seen = [(torque.within(span), wheel.within(span)) for span in near]
    i_f, alone = card.final_drive, []
    for k, (span, (T_o, w)) in enumerate(zip(spans, seen, strict=True)):
        tell(0.5 * k / len(spans))
        alone.append(own_load(T_o, w, i_f, span))
    vehicle = vehicle_of([one for one in alone if one is not None])
    left = [float("inf") if one is None else one.left for one in alone]
    if vehicle is None:
        return left
    for k, (span, (T_o, w)) in enumerate(zip(spans, seen, strict=True)):
        tell(0.5 + 0.5 * k / len(spans))
        one = None if alone[k] is None else own_load(T_o, w, i_f, span, vehicle)
        left[k] = float("inf") if one is None else one.left
    return left


def _first(shifts: Sequence[Shift], left: Sequence[float], steady: Sequence[int]) -> list[int]:
    """At most MOST of `steady`: the best of every change of gears, then the second best, ..."""
    kinds: dict[tuple[str, str, str], list[int]] = {}
    for k in sorted(steady, key=lambda k: left[k]):
        one = shifts[k]
        kinds.setdefault((one.start_gear, one.end_gear, one.kind), []).append(k)
    ranked = [(place, left[k], k) for same in kinds.values() for place, k in enumerate(same)]
    return [k for _, _, k in sorted(ranked)[:MOST]]
