# SPDX-License-Identifier: MIT
"""Delay of the output torque that the log check has found, as the start of a fit.

The check compares the torque with the acceleration of the vehicle, so that tyre slip adds to the
delay. The momentum balance of the gearbox contains no wheel: it decides on the part that is a
delay. The remainder is left to the effect `output_torque_delay`, whose zero is then here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM
from drivetwin.estimation.data.shift_data import PreparedLog, ShiftData
from drivetwin.estimation.direct.momentum_balance import (
    DELAY,
    estimate_momentum_inertia,
    interpolate_parabola_minimum,
)
from drivetwin.findings import Code, Number, report
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import compute_middle

FOUND = (Code.TORQUE_CLOCK_LATE, Code.TORQUE_LATE_OR_SLIP)
"""Findings of the log check on a delay between output torque and speeds."""
PARTS = 6
"""Parts of the found delay at whose ends the balance is computed [count]: those of 30 ms are
shorter than twice the usual delay that the effect allows."""


def align_output_torque(log: PreparedLog) -> PreparedLog:
    """Return the log with the output torque at the stamps that its momentum balance supports.

    The log is returned as it is without a delay that its check has found, where the card states
    the delay, and where the balance hardly improves.
    """
    found = [one for one in log.findings if one.code in FOUND]
    late = [one for one in found if one.names["role"] == "output_torque"]
    if not late or EffectId.OUTPUT_TORQUE_DELAY in log.design.effects:
        return log
    shifts = np.linspace(0.0, late[0].numbers["shift"].value, PARTS + 1)
    try:
        powers = np.array([_compute_power(log, float(shift)) for shift in shifts])
    except IdentificationError:
        return log
    if powers[0] - powers.min() < DELAY.min_rise:
        return log
    best = interpolate_parabola_minimum(shifts, powers)
    moved = report(
        Code.OUTPUT_TORQUE_ALIGNED,
        "",
        late[0].place,
        shift=Number(best, "s"),
        found=late[0].numbers["shift"],
    )
    return replace(
        log,
        shifts=tuple(_move(one, best) for one in log.shifts),
        findings=(*log.findings, moved),
    )


def _compute_power(log: PreparedLog, shift: float) -> float:
    """Compute Q of the momentum balance over all shifts with the output torque moved by `shift`
    [s]."""
    start = compute_middle(log.design.J_prime_range)
    moved = [_move(one, shift) for one in log.shifts]
    fits = [estimate_momentum_inertia(one.signals, one.driveline, MOMENTUM, start) for one in moved]
    return sum(one.fit.q for one in fits)


def _move(one: ShiftData, shift: float) -> ShiftData:
    """Move the output torque of a shift by `shift` [s]."""
    torque = one.signals.output_torque
    moved = replace(torque, time=torque.time + shift)
    signals = replace(one.signals, output_torque=moved, output_torque_shift=shift)
    return replace(one, signals=signals)
