# SPDX-License-Identifier: MIT
"""Torque balance of a slipping clutch in a shift, for an actuator without measured pressure.

The torque of the other clutch (index 1) is eliminated from both balances of the dual-clutch
driveline (THEORY section 3), with i_out and α of both:

    T_o + Jo' ω_out' = (i_1/α_1)·(η T_e - J' ω_e') + (i_2 - i_1 α_2/α_1)·T_2

This holds whether the other clutch locks, slips or is open. η, J' and the age of T_e are unknown
constants. It is integrated over time, so that no speed is differentiated, and solved for ω_e, whose
noise is by far the largest: as a regressor it would bias J'.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.signal_processing import integrate_trapezoids
from drivetwin.actuator.from_torque import TorqueRecord
from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.data.prepare import build_driveline
from drivetwin.estimation.data.prepare_signal import prepare_signal
from drivetwin.estimation.data.shift_data import ShiftElementKinematics
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import compute_middle
from drivetwin.vehicle.vehicle_card import VehicleCard

_STEP = 1e-3
"""Step [s] of the raster on which the clutch torque is computed."""
_BLOCK = 5
"""Samples of the raster of which means are compared."""
_BEFORE = 0.6
"""Time [s] before the torque phase from which the balance is used."""
_GUARD = 0.005
"""Time [s] kept from break-away and lock-up, beside three standard deviations."""
_NEEDED = ("engine_torque", "output_torque", "output_speed")
"""Roles that the balance needs, beside the speed of engine or input."""


def build_torque_records(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], element: str, command: HeldSignal
) -> list[TorqueRecord]:
    """Return the balance of a clutch in each shift in which it slips.

    An on-coming clutch slips from before the shift until it locks, an off-going one from the start
    of the inertia phase. Shifts with too few samples have no balance.
    """
    found = []
    for shift in shifts:
        end = shift.lockup_time - _GUARD - 3.0 * shift.sigma.get("lockup", 0.0)
        if element == shift.oncoming:
            start, other = shift.torque_phase[0] - _BEFORE, shift.offgoing
        elif element == shift.offgoing:
            guard = _GUARD + 3.0 * shift.sigma.get("inertia_start", 0.0)
            start, other = shift.inertia_phase[0] + guard, shift.oncoming
        else:
            continue
        known = build_driveline(card, shift).couplings
        clutches = known[element], known[other]
        one = _build_record(log, card, (max(start, shift.before[0]), end), clutches, command)
        found += [] if one is None else [one]
    return found


def _build_record(
    log: ShiftLog,
    card: VehicleCard,
    span: tuple[float, float],
    clutches: tuple[ShiftElementKinematics, ShiftElementKinematics],
    command: HeldSignal,
) -> TorqueRecord | None:
    of_input = ("input_speed", card.i_in.value)
    role, factor = ("engine_speed", 1.0) if "engine_speed" in log else of_input
    if any(one not in log for one in (*_NEEDED, role)):
        return None
    count = int((span[1] - span[0]) / _STEP) // _BLOCK * _BLOCK
    time: FloatArray = span[0] + _STEP * np.arange(count, dtype=np.float64)
    torque, output, out_speed, speed = (
        log[one].updates.interpolate(time) for one in (*_NEEDED, role)
    )
    if count < 2 or not np.isfinite(torque + output + out_speed + speed).all():
        return None
    speed = factor * speed
    own, other = clutches
    J_out = 0.0 if card.J_out is None else card.J_out.value
    driven = other.ratio
    integral = integrate_trapezoids(np.column_stack([output, torque]), time)
    noise = {one: prepare_signal(log[one]).sigma for one in (*_NEEDED, role)}
    drift = _grow_drift(log["output_torque"].updates, noise["output_torque"], time)
    drift += driven**2 * _grow_drift(log["engine_torque"].updates, noise["engine_torque"], time)
    averaged = max(_BLOCK * _STEP / log[role].updates.step, 1.0)
    return TorqueRecord(
        command=command,
        time=time,
        slip=own.a * speed - own.b * out_speed,
        target=speed,
        regressors=np.column_stack(
            [integral[:, 0] + J_out * out_speed, driven * integral[:, 1], driven * torque]
        ),
        lever=own.b - driven * own.a,
        white=factor * noise[role] / np.sqrt(averaged),
        drift=drift / (driven * compute_middle(card.J_prime_range)) ** 2,
        block=_BLOCK,
    )


def _grow_drift(torque: Channel, sigma: float, time: FloatArray) -> FloatArray:
    """Variance [(N·m·s)²] of the integral of a sampled torque since `time[0]`, at `time` (n,).

    Each interval h adds that of the noise and that of a change ΔT at an unknown instant in it,
    (σ h)² + (ΔT h)²/12.
    """
    step = np.diff(torque.time)
    added = (sigma * step) ** 2 + (np.diff(torque.values) * step) ** 2 / 12.0
    total = np.interp(time, torque.time, np.concatenate([[0.0], np.cumsum(added)]))
    return np.asarray(total - total[0], dtype=np.float64)
