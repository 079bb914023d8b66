# SPDX-License-Identifier: MIT
"""Load torque T_v/i_f and vehicle inertia J3 (eq. 11) in momentum form, and terms of the load.

T_o - T_v/i_f = (J3/i_f)·ω_w'
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.select_shifts import (
    INERTIA,
    LOAD,
    WIDTH,
    VehicleBalance,
    build_recorded_windows,
)
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.likelihood.point import Prior

WINDOW = 0.01
"""Averaging window of speeds and torques [s], that of the paper's procedure."""


def compute_window_means(signal: MeasuredSignal, edges: FloatArray) -> FloatArray:
    """Mean of the samples in each half-open window between `edges` (m+1,); shape (m,).

    A window without a sample takes the value interpolated at its start, NaN inside a gap.
    """
    index = np.searchsorted(edges, signal.time + 1e-9, side="right") - 1
    inside = (index >= 0) & (index < edges.size - 1)
    count = np.bincount(index[inside], minlength=edges.size - 1)
    total = np.bincount(index[inside], weights=signal.values[inside], minlength=edges.size - 1)
    return np.where(
        count > 0, total / np.maximum(count, 1), signal.interpolate_at_times(edges[:-1])
    )


def drop_nan_rows(*columns: FloatArray) -> tuple[FloatArray, ...]:
    """The columns (n,) without the rows in which one of them is NaN; shape (m,) each.

    Raises IdentificationError where fewer than three rows remain.
    """
    known = np.isfinite(np.vstack(columns)).all(axis=0)
    if np.count_nonzero(known) < 3:
        raise IdentificationError(
            "the signals share next to no time of the held gear: their gaps cover it",
            "record the shift again, or map another sensor to the channel that drops out",
        )
    return tuple(column[known] for column in columns)


def compute_window_edges(span: Span, width: float = WINDOW) -> FloatArray:
    """Edges of the averaging windows that fit into `span` [s].

    Raises IdentificationError where fewer than five windows fit.
    """
    count = int((span[1] - span[0]) / width + 1e-6)
    if count < 5:
        raise IdentificationError(
            f"only {span[1] - span[0]:.3f} s of held gear: a slope over {width:g} s windows "
            "cannot be formed",
            "start the recording earlier before the shift, or stop it later",
        )
    return np.asarray(span[0] + width * np.arange(count + 1), dtype=float)


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


def report_different_loads(loads: Sequence[float]) -> list[Finding]:
    """Report different loads of the shifts [N m]; empty for a single common load."""
    if not loads:
        return []
    low, high = (Number(load, "N*m") for load in (min(loads), max(loads)))
    return [report(Code.LOADS_DIFFER, low=low, high=high)]


def compute_mean_speed(signals: Sequence[ShiftSignals], i_f: float) -> float:
    """Mean wheel speed over the log [rad/s]."""
    means = [
        float(np.mean(s.output_speed.values)) / i_f
        if s.wheel_speed is None
        else float(np.mean(s.wheel_speed.values))
        for s in signals
    ]
    return float(np.mean(means))


def estimate_load(signals: ShiftSignals, i_f: float) -> tuple[float, float]:
    """Estimate (T_v/i_f [N m], J3 [kg m^2]) of one shift from eq. 11.

    Without a wheel speed the output speed divided by i_f takes its place, away from the shift.
    Raises IdentificationError where torque and speed do not determine both.
    """
    shift, torque, wheel = signals.shift, signals.output_torque, signals.wheel_speed
    if wheel is None:
        settled = shift.lockup_time + LOAD_BALANCE.settling
        speed, ratio = signals.output_speed, 1.0 / i_f
        spans = [shift.before, (settled, shift.after[1])]
    else:
        speed, ratio, spans = wheel, 1.0, [(shift.before[0], shift.after[1])]
    windows = build_recorded_windows(torque, speed, spans, WIDTH / 16.0)
    if not windows.count:
        raise IdentificationError(
            f"no {WIDTH:g} s of held gear without a gap for the balance of the vehicle",
            "record at least a second before and after the shift",
        )
    balance = VehicleBalance.from_torque(torque, speed, (ratio, i_f), windows)
    start = np.array([float(np.mean(torque.values)), 1.0])
    theta = balance.solve_load(None, start, Prior.from_independent(2, {})).theta
    return float(theta[LOAD]), float(theta[INERTIA])
