# SPDX-License-Identifier: MIT
"""Load torque T_v/i_f and vehicle inertia J3 (eq. 11), the paper's way and in momentum form.

T_o - T_v/i_f = (J3/i_f)·ω_w'

Where the load grows with the square of the speed, T_v/i_f holds at the mean speed of the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.select_shifts import (
    GROWTH,
    INERTIA,
    LOAD,
    WIDTH,
    VehicleBalance,
    build_recorded_windows,
)
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.regression.errors_in_variables import Fit, Prior
from drivetwin.estimation.result.cause import SHOWN
from drivetwin.findings import Code, Finding, Number, report


@dataclass(frozen=True)
class LoadSettings:
    """Settings of the load and of its growth with speed."""

    aero_std: float = 10.0
    """Plausible air drag at the wheel [N m s^2/rad^2]: of a lorry 1 to 3, of a car 0.1."""
    settling: float = 0.5
    """Time after lock-up in which the output speed cannot replace the wheel speed [s]."""


LOAD_BALANCE = LoadSettings()


AERO = "aero"
"""The part of the load that grows with the square of the speed, at the wheel [N m s^2/rad^2]."""


@dataclass(frozen=True, eq=False)
class LoadFit:
    """Regression of eq. 11: θ = (T_v/i_f, J3) in `fit`, and AERO where the load may grow.

    Evidence, one entry per window: `time` [s], `torque` = mean T_o less the load [N m],
    `acceleration` = mean ω_w' [rad/s^2]. `mean_speed` is that of the wheel [rad/s];
    `speed_trend` the t value of a residual proportional to the speed's deviation from it.
    `holds_at` is the speed [rad/s] at which T_v/i_f holds, None where the load does not grow.
    """

    fit: Fit
    time: FloatArray
    torque: FloatArray
    acceleration: FloatArray
    mean_speed: float
    speed_trend: float
    holds_at: float | None = None

    @property
    def load(self) -> float:
        """T_v/i_f [N m]."""
        return float(self.fit.theta[LOAD])

    @property
    def J_vehicle(self) -> float:
        """J3 at the wheel [kg m^2]."""
        return float(self.fit.theta[INERTIA])


def compute_term_evidence(values: FloatArray, covariance: FloatArray, std: float) -> float:
    """Compute the log evidence of a term of the load against its absence.

    With the prior variance S = `std`²·1 of its unknowns about zero, and their estimates v of
    covariance C, it is ½·vᵀ(C⁻¹ - (C + S)⁻¹)v - ½·log|1 + C⁻¹S|.

    Parameters
    ----------
    values
        Estimates (m,) of the unknowns.
    covariance
        Their covariance (m, m).
    std
        Prior standard deviation of each.

    Returns
    -------
    float
        Log evidence [-].
    """
    unit, own = values / std, covariance / std**2
    wide = own + np.eye(unit.size)
    explained = unit @ (np.linalg.pinv(own, hermitian=True) - np.linalg.inv(wide)) @ unit
    volume = np.linalg.slogdet(wide)[1] - np.linalg.slogdet(own)[1]
    return float(0.5 * explained - 0.5 * volume)


def is_common_load(loads: FloatArray, covariance: FloatArray) -> bool:
    """Return whether one load of all shifts is likelier than one of each, with odds of 20.

    A load too many costs a little width, one too few moves J3 and η on hills. The grade changes
    `loads` (n,) of covariance (n, n) by about as much as they are.
    """
    rows = np.eye(loads.size)[1:] - np.eye(loads.size)[0]
    scale = float(np.sqrt(np.mean(np.square(loads))))
    return compute_term_evidence(rows @ loads, rows @ covariance @ rows.T, scale) < -SHOWN


def report_different_loads(loads: Sequence[float]) -> list[Finding]:
    """Report different loads of the shifts [N m]; empty for a single common load."""
    if not loads:
        return []
    low, high = (Number(load, "N*m") for load in (min(loads), max(loads)))
    return [report(Code.LOADS_DIFFER, low=low, high=high)]


def select_load_spans(signals: ShiftSignals) -> tuple[Span, ...]:
    """Return the spans for eq. 11: all with a wheel speed, else those away from the shift."""
    shift = signals.shift
    if signals.wheel_speed is not None:
        return ((shift.before[0], shift.after[1]),)
    return (shift.before, (shift.lockup_time + LOAD_BALANCE.settling, shift.after[1]))


def find_growth_reference(signals: Sequence[ShiftSignals], i_f: float) -> float | None:
    """Mean wheel speed of the log [rad/s] if the load of its shifts grows with speed, else None.

    The growth is estimated within each shift, so hills between shifts have no influence. Raises
    IdentificationError if torque and speed of a shift do not determine its load.
    """
    speed = compute_mean_speed(signals, i_f)
    fits = [estimate_momentum_load(s, i_f, select_load_spans(s), speed).fit for s in signals]
    growth = np.array([fit.theta[GROWTH] for fit in fits])
    weight = np.array([fit.std[GROWTH] ** -2 for fit in fits])
    mean, variance = growth @ weight / np.sum(weight), 1.0 / np.sum(weight)
    nats = compute_term_evidence(np.array([mean]), np.array([[variance]]), LOAD_BALANCE.aero_std)
    return speed if mean > 0.0 and nats > SHOWN else None


def compute_mean_speed(signals: Sequence[ShiftSignals], i_f: float) -> float:
    """Mean wheel speed over the log [rad/s]."""
    means = [
        float(np.mean(s.output_speed.values)) / i_f
        if s.wheel_speed is None
        else float(np.mean(s.wheel_speed.values))
        for s in signals
    ]
    return float(np.mean(means))


def estimate_momentum_load(
    signals: ShiftSignals,
    i_f: float,
    spans: tuple[Span, ...],
    holds_at: float | None = None,
    width: float = WIDTH,
) -> LoadFit:
    """Estimate (T_v/i_f, J3) from the balance of the vehicle over all windows.

    Eq. 11 is independent of the gear, so `spans` may cover the whole log if the wheel speed is
    measured. With `holds_at` [rad/s] the load may grow with speed; T_v/i_f refers to this speed.
    Raises IdentificationError where torque and speed do not determine both.
    """
    wheel = signals.wheel_speed
    speed, ratio = (signals.output_speed, 1.0 / i_f) if wheel is None else (wheel, 1.0)
    torque, step = signals.output_torque, width / 16.0
    windows = build_recorded_windows(torque, speed, spans, step, width)
    if not windows.count:
        raise IdentificationError(
            f"no {width:g} s of held gear without a gap for the balance of the vehicle",
            "record at least a second before and after the shift",
        )
    balance = VehicleBalance.from_torque(torque, speed, (ratio, i_f), windows)
    start = np.array([float(np.mean(torque.values)), 1.0])
    if holds_at is None:
        fit = balance.solve_load(None, start, Prior.from_independent(2, {}))
        load = np.full(windows.count, fit.theta[LOAD])
    else:
        grown = (balance.square - holds_at**2) / i_f
        prior = Prior.from_independent(3, {GROWTH: (0.0, LOAD_BALANCE.aero_std)})
        fit = balance.solve_load(grown, np.append(start, 0.0), prior)
        load = fit.theta[LOAD] + fit.theta[GROWTH] * grown
    local = speed.interpolate_at_times(windows.centre) * ratio
    centred = local - local.mean()
    z = fit.residual / fit.residual_std
    spread = float(np.sqrt(np.sum(centred**2)))
    overlap = np.sqrt(width / step * 0.375)
    return LoadFit(
        fit,
        windows.centre,
        balance.mean_torque - load,
        balance.acceleration,
        float(local.mean()),
        float(z @ centred) / (spread * overlap) if spread > 0.0 else 0.0,
        holds_at,
    )
