# SPDX-License-Identifier: MIT
"""Gear efficiency η and lumped inertia J′ (eq. 10), the paper's way and in momentum form.

η·T_e - T_o/i_g = J′·ω_e'        J′ = Je + Jo′/i_g²,  Je = J1·η + J2e
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.paper.wlse import (
    GridFit,
    GridRow,
    Weighting,
    compute_central_difference,
    compute_window_edges,
    compute_window_means,
    drop_nan_rows,
    fit_weighted_inertia,
)

ETA_GRID = tuple(round(1.0 - 0.05 * k, 2) for k in range(7))
"""Grid of the paper: 1.00 down to 0.70 in steps of 0.05."""


@dataclass(frozen=True)
class PaperInertiaSettings:
    """Grid of η and weighting of the paper's search; J′ range in kg·m² at the engine."""

    weighting: Weighting
    eta_grid: tuple[float, ...] = ETA_GRID


def estimate_paper_inertia(
    signals: ShiftSignals, ratio: float, span: Span, settings: PaperInertiaSettings
) -> GridFit:
    """Search η on the grid; J′ by weighted least squares for each (THEORY section 4).

    `ratio` is the overall ratio i_g of the gear held during `span` [s]. The RMS error is that of
    eq. 10, unweighted, times i_g: a torque at the output shaft [N m].
    """
    edges = compute_window_edges(span)
    acceleration = compute_central_difference(compute_window_means(signals.engine_speed, edges))
    engine_torque = compute_window_means(signals.engine_torque, edges)[1:-1]
    output_torque = compute_window_means(signals.output_torque, edges)[1:-1]
    acceleration, engine_torque, output_torque = drop_nan_rows(
        acceleration, engine_torque, output_torque
    )

    def excess(eta: float) -> FloatArray:
        return eta * engine_torque - output_torque / ratio

    def row(eta: float) -> GridRow:
        inertia, _ = fit_weighted_inertia(excess(eta), acceleration, settings.weighting)
        residual = excess(eta) - inertia * acceleration
        return GridRow(eta, inertia, float(ratio * np.sqrt(np.mean(residual**2))))

    rows = tuple(row(eta) for eta in settings.eta_grid)
    best = min(rows, key=lambda r: r.rmse)
    torque = excess(best.value)
    _, weights = fit_weighted_inertia(torque, acceleration, settings.weighting)
    return GridFit(rows, best, acceleration, torque, excess(rows[0].value), weights)
