# SPDX-License-Identifier: MIT
"""Closed-form estimate of the error of the dual-clutch form without M12.

The reference shift has constant torques in each phase. The derivation is in
docs/explanation/coupling-error.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivetwin.gearbox.maneuver import RAMP, CouplingError, Maneuver, Traces, build_time_grid, plan
from drivetwin.gearbox.reduction import Reduction
from drivetwin.gearbox.spec import Drive
from drivetwin.simulation.dual_clutch import FloatArray, compute_series_inertia

_GROWTH_STEPS = 4
"""Fixed-point steps for the slip left when the first model locks; the growth is moderate."""


def estimate(reduction: Reduction, drive: Drive | None = None) -> CouplingError:
    """Estimate the error of leaving M12 out, from M12 and the operating point of the shift.

    Raises ReductionError where no reference shift can be planned.
    """
    maneuver = plan(reduction, drive or reduction.gearbox.require_drive())
    time = build_time_grid(maneuver)
    time = time[time >= maneuver.release]
    coupled = _estimate_inertia_phase(reduction, maneuver, reduction.M12)
    alone = _estimate_inertia_phase(reduction, maneuver, 0.0)
    full = _compute_motion(reduction, maneuver, coupled, time)
    form = _compute_motion(reduction, maneuver, alone, time)
    error = full.compute_largest_difference(form)
    return CouplingError(
        shaft_torque=error.shaft_torque,
        input_speed=max(error.input_speed, abs(coupled.in_at_lock)),
        output_speed=max(error.output_speed, abs(coupled.out_at_lock)),
    )


@dataclass(frozen=True)
class _InertiaPhase:
    """First-order effect of the coupling M12 on the motion before lock-up.

    `M12` [kg m^2]; `ahead` the output speed gained before the release, `shift_in` and `shift_out`
    what the coupling adds to the swings, `in_at_lock` and `out_at_lock` the whole differences when
    the first of both models locks [rad/s]; `lock` the instant of lock-up [s]; `torque` the shaft
    torque then [N m].
    """

    M12: float
    ahead: float
    shift_in: float
    shift_out: float
    in_at_lock: float
    out_at_lock: float
    lock: float
    torque: float


def _estimate_inertia_phase(reduction: Reduction, maneuver: Maneuver, M12: float) -> _InertiaPhase:
    i_c, i_out = reduction.on_coming.i_c, reduction.on_coming.i_out
    J_in = maneuver.drive.engine_inertia + reduction.M11
    J_rigid = reduction.M22 + maneuver.vehicle
    ahead = _estimate_head_start(reduction, maneuver, M12)
    shift_in = -M12 / J_in * maneuver.swing_out
    shift_out = -M12 / J_rigid * maneuver.swing_in
    end_in, end_out = shift_in + maneuver.old_ratio * ahead, shift_out + ahead
    slip = end_in / i_c - i_out * end_out

    pace = maneuver.lock - maneuver.release - 0.5 * RAMP
    slip_rate = (maneuver.swing_in / i_c - i_out * maneuver.swing_out) / pace

    def rates(torque: float) -> tuple[float, float]:
        into = (maneuver.engine_torque - torque / i_c) / J_in
        return into, (i_out * torque - maneuver.load - M12 * into) / J_rigid

    # A slip that is ahead in time grows with its own rate: friction that rises towards zero slip
    # does it, with an impulse on both shafts. The rate is the mean over what is left to slip.
    left, growth = slip, 0.0
    for _ in range(_GROWTH_STEPS):
        into, out_of = rates(maneuver.compute_mean_torque(abs(left)))
        growth = (into / i_c - i_out * out_of) / slip_rate - 1.0
        left = slip * (1.0 + growth)
    impulse = slip * growth / (1.0 / (i_c**2 * J_in) + i_out**2 / J_rigid)
    _, out_of_lock = rates(maneuver.compute_mean_torque(0.0))
    return _InertiaPhase(
        M12=M12,
        ahead=ahead,
        shift_in=shift_in,
        shift_out=shift_out,
        in_at_lock=end_in + impulse / (i_c * J_in),
        out_at_lock=end_out - i_out * impulse / J_rigid,
        lock=maneuver.lock - slip / slip_rate,
        torque=maneuver.load + maneuver.vehicle * out_of_lock,
    )


def _estimate_head_start(reduction: Reduction, maneuver: Maneuver, M12: float) -> float:
    """Output speed gained before the release because of `M12`, rad/s."""
    i, new = maneuver.old_ratio, reduction.on_coming
    inertia = (maneuver.drive.engine_inertia + reduction.M11) * i**2 + reduction.M22
    grip = i / new.i_c - new.i_out
    coupled = maneuver.compute_speed_gain(inertia + 2.0 * M12 * i, grip)
    return coupled - maneuver.compute_speed_gain(inertia, grip)


def _compute_motion(
    reduction: Reduction, maneuver: Maneuver, phase: _InertiaPhase, time: FloatArray
) -> Traces:
    drive, i_h, J5 = maneuver.drive, maneuver.new_ratio, maneuver.vehicle
    done = np.clip((time - maneuver.release) / (phase.lock - maneuver.release), 0.0, 1.0)
    start_in = drive.engine_speed + maneuver.old_ratio * phase.ahead
    start_out = maneuver.output_speed + phase.ahead
    # Both models run at the same pace; the one that locks earlier has swung less.
    share = (phase.lock - maneuver.release) / (maneuver.lock - maneuver.release)
    swing_in = (maneuver.swing_in + phase.shift_in) * share
    swing_out = (maneuver.swing_out + phase.shift_out) * share

    # Gear h: two masses and the shaft between them, released from the torque of the inertia phase.
    J_in = drive.engine_inertia + reduction.M11
    J4 = J_in * i_h**2 + 2.0 * phase.M12 * i_h + reduction.M22
    acceleration = (i_h * maneuver.engine_torque - maneuver.load) / (J4 + J5)
    settled = maneuver.load + J5 * acceleration
    after = np.maximum(time - phase.lock, 0.0)
    decay, twist_rate = _compute_release_response(drive, compute_series_inertia(J4, J5), after)
    locked = time >= phase.lock
    relative = J5 / (J4 + J5) * (phase.torque - settled) * twist_rate
    output = start_out + swing_out * done + np.where(locked, acceleration * after + relative, 0.0)
    return Traces(
        shaft_torque=np.where(locked, settled + (phase.torque - settled) * decay, phase.torque),
        input_speed=np.where(locked, i_h * output, start_in + swing_in * done),
        output_speed=output,
    )


def _compute_release_response(
    drive: Drive, J: float, after: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Shaft torque and rate of twist per unit torque released at rest, after each time.

    `J` is the inertia of both masses in series [kg m^2].
    """
    natural = math.sqrt(drive.shaft_stiffness / J)
    zeta = drive.shaft_damping / (2.0 * math.sqrt(drive.shaft_stiffness * J))
    # Complex frequency: one formula for the damped oscillation and for the overdamped shaft.
    damped = natural * np.sqrt(complex(1.0 - zeta**2))
    envelope = np.exp(-zeta * natural * after)
    sine = envelope * np.real(np.sin(damped * after) / damped)
    cosine = envelope * np.real(np.cos(damped * after))
    twist = (cosine + zeta * natural * sine) / drive.shaft_stiffness
    rate = -(natural**2) * sine / drive.shaft_stiffness
    return drive.shaft_stiffness * twist + drive.shaft_damping * rate, rate
