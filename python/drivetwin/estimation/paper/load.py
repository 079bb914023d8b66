# SPDX-License-Identifier: MIT
"""Load by the paper's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import Span
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


@dataclass(frozen=True)
class PaperLoadSettings:
    """Two-stage grid of T_v/i_f [N m] and weighting of the paper; J3 range in kg·m²."""

    weighting: Weighting
    stop: float = 4000.0
    coarse: float = 500.0
    fine: float = 100.0


def estimate_paper_load(
    signals: ShiftSignals, i_f: float, span: Span, settings: PaperLoadSettings
) -> GridFit:
    """Search T_v/i_f from 0 to `stop` in coarse steps, then in fine ones around the best.

    The RMS error is that of eq. 11 divided by i_f: a torque at the output shaft [N m]. Without a
    wheel-speed channel the output speed divided by i_f stands in for it.
    """
    edges = compute_window_edges(span)
    if signals.wheel_speed is not None:
        speed = compute_window_means(signals.wheel_speed, edges)
    else:
        speed = compute_window_means(signals.output_speed, edges) / i_f
    acceleration = compute_central_difference(speed)
    output_torque = compute_window_means(signals.output_torque, edges)[1:-1]
    acceleration, output_torque = drop_nan_rows(acceleration, output_torque)

    def row(load: float) -> GridRow:
        torque = output_torque - load
        slope, _ = fit_weighted_inertia(torque, acceleration, settings.weighting, scale=i_f)
        residual = torque - slope * acceleration
        return GridRow(float(load), i_f * slope, float(np.sqrt(np.mean(residual**2))))

    coarse = [row(v) for v in np.arange(0.0, settings.stop + 1e-9, settings.coarse)]
    centre = min(coarse, key=lambda r: r.rmse).value
    near = np.arange(centre - settings.coarse, centre + settings.coarse + 1e-9, settings.fine)
    tabulated = {r.value for r in coarse}
    fine = [row(v) for v in near if v >= 0.0 and float(v) not in tabulated]
    rows = tuple(sorted([*coarse, *fine], key=lambda r: r.value))
    best = min(rows, key=lambda r: r.rmse)
    torque = output_torque - best.value
    _, weights = fit_weighted_inertia(torque, acceleration, settings.weighting, scale=i_f)
    return GridFit(rows, best, acceleration, torque, output_torque - rows[0].value, weights)
