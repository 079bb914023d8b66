# SPDX-License-Identifier: MIT
"""Which shifts of a whole drive are fitted: those with one load, as many as tell something new.

On a road the vehicle is braked and hills come and go, which no channel tells. A shift over which
the load is not constant spoils the fit of all others, so it is left out where others do without.
Beyond MOST shifts the sensors' tolerances decide, and time and memory of a fit grow with them:
every change of gears then counts first with the shift that leaves least of the load unexplained.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identify.inputs import BESIDE, sampled
from drivetwin.identify.load import load_left
from drivetwin.identify.signals import Sampled
from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.spec import VehicleCard

MOST = 12
"""Most shifts of one log in one fit."""
CONSTANT = 20.0
"""Noise power left by eq. 11 up to which a load counts as constant, over that of the best shift:
braked ones leave 30 to 1000 times as much, others up to 4 times. That of the best is 1, or what a
delay of the sensors makes of it, which is the same in all."""


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
    """What `load_left` says of each shift; 0 for all without an output torque."""
    if "output_torque" not in log:
        return [0.0] * len(shifts)
    torque = sampled(log["output_torque"])
    if "wheel_speed" in log:
        wheel = sampled(log["wheel_speed"])
    else:
        wheel = sampled(log["output_speed"], 1.0 / card.final_drive)
    found = []
    for one in shifts:
        span = one.before[0], one.after[1]
        near = span[0] - BESIDE, span[1] + BESIDE
        parts: list[Sampled] = [torque.within(near), wheel.within(near)]
        found.append(load_left(parts[0], parts[1], card.final_drive, span))
    return found


def _first(shifts: Sequence[Shift], left: Sequence[float], steady: Sequence[int]) -> list[int]:
    """At most MOST of `steady`: the best of every change of gears, then the second best, ..."""
    kinds: dict[tuple[str, str, str], list[int]] = {}
    for k in sorted(steady, key=lambda k: left[k]):
        one = shifts[k]
        kinds.setdefault((one.start_gear, one.end_gear, one.kind), []).append(k)
    ranked = [(place, left[k], k) for same in kinds.values() for place, k in enumerate(same)]
    return [k for _, _, k in sorted(ranked)[:MOST]]
