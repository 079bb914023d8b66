# SPDX-License-Identifier: MIT
"""Coefficients of the Stribeck law: μ over slip, derivatives, and a first fit to points of μ."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM, find_off_going_release
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.load_balance import (
    compute_window_edges,
    compute_window_means,
    drop_nan_rows,
)
from drivetwin.simulation.dual_clutch import Stribeck


@dataclass(frozen=True)
class FrictionPointSettings:
    """Settings of the friction points and of the law through them."""

    margin: float = 0.012
    """Distance of the last window from lock-up [s]."""
    filled: float = 5e3
    """Pressure above P0 from which an element transmits torque [Pa]."""
    min_points: int = 5
    """Fewest points of a law [count]: one more than its coefficients."""
    model_std: float = 0.02
    """Standard deviation of T_c ≈ T_o/i_out, which omits Jo′ and drums, over T_c [ratio]."""
    slip_scales: tuple[float, ...] = tuple(np.geomspace(4.0, 60.0, 12).tolist())
    """Tried v_s [rad/s]: within two prior standard deviations."""


POINTS = FrictionPointSettings()


def estimate_friction_law(signals: ShiftSignals, driveline: KnownDriveline) -> FloatArray:
    """Estimate (mu_c, mu_s - mu_c, mu_v, ln v_s) of the on-coming element with their wide priors.

    Returns
    -------
    FloatArray
        Coefficients (4,); speeds in rad/s.

    Raises
    ------
    IdentificationError
        If too few windows of the inertia phase contain its torque alone.
    """
    slip, capacity, torque = _read_points(signals, driveline)
    noise = POINTS.model_std * np.abs(torque) + signals.output_torque.sigma / driveline.oncoming.b
    means, stds = np.array([LAW_PRIOR[k] for k in range(LOG_V + 1)]).T
    best, least = np.empty(0), np.inf
    for v_s in POINTS.slip_scales:
        _, slopes = evaluate_stribeck(np.array([0.0, 0.0, 0.0, np.log(v_s)]), slip)
        law = slopes[:LOG_V].T
        rows = np.vstack([capacity[:, None] * law / noise[:, None], np.diag(1.0 / stds[:LOG_V])])
        target = np.concatenate([torque / noise, means[:LOG_V] / stds[:LOG_V]])
        found = np.linalg.lstsq(rows, target, rcond=None)[0]
        away = (np.log(v_s) - means[LOG_V]) / stds[LOG_V]
        cost = float(np.sum((rows @ found - target) ** 2) + away**2)
        if cost < least:
            best, least = np.append(found, np.log(v_s)), cost
    return best


def _read_points(
    signals: ShiftSignals, driveline: KnownDriveline
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return slip [rad/s], signed capacity gain·(P - P0) and T_c [N m] by window, each (n,)."""
    element, lockup = driveline.oncoming, signals.shift.lockup_time
    free = find_off_going_release(signals, driveline, MOMENTUM)
    edges = compute_window_edges((free, lockup - POINTS.margin))
    channels = (
        *(signals.engine_speed, signals.output_speed),
        *(signals.pressures[element.name], signals.output_torque),
    )
    engine, output, pressure, torque = drop_nan_rows(
        *(compute_window_means(one, edges) for one in channels)
    )
    slip = element.a * engine - element.b * output
    above = pressure - element.P0.value
    kept = above > POINTS.filled
    if np.count_nonzero(kept) < POINTS.min_points:
        raise IdentificationError(
            f"the inertia phase leaves {np.count_nonzero(kept)} friction points",
            "log a slower shift, or one with the off-going element vented earlier",
        )
    capacity = np.sign(slip[kept]) * element.gain * above[kept]
    return np.abs(slip[kept]), capacity, torque[kept] / element.b


MU_C, MU_DROP, MU_V, LOG_V, P0 = range(5)
LAW_PRIOR = {MU_C: (0.12, 0.2), MU_DROP: (0.0, 0.1), MU_V: (0.0, 2e-3), LOG_V: (np.log(15.0), 1.0)}
"""Wide priors of the Stribeck law: wet clutch facings; v_s within a factor e of 15 rad/s."""


def evaluate_stribeck(theta: FloatArray, slip: FloatArray) -> tuple[FloatArray, FloatArray]:
    """μ (n,) over |slip| (n,) and its derivatives (4, n) by (mu_c, mu_drop, mu_v, ln v_s)."""
    mu_c, drop, mu_v, ln_v_s = (float(theta[k]) for k in (MU_C, MU_DROP, MU_V, LOG_V))
    law = Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)
    return law.evaluate(slip), law.compute_slopes(slip)


def build_law_derivatives(v_s: float) -> FloatArray:
    """Derivatives (4, 4) of mu_c, mu_s, v_s, mu_v by (mu_c, mu_drop, mu_v, ln v_s)."""
    return np.array([[1.0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, v_s], [0, 0, 1, 0]])
