# SPDX-License-Identifier: MIT
"""Friction curve by the paper's method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.linear.friction_points import compute_mean_slip
from drivetwin.estimation.paper.wlse import (
    compute_window_edges,
    compute_window_means,
    drop_nan_rows,
)
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.simulation.dual_clutch import Stribeck


@dataclass(frozen=True, eq=False)
class PaperFriction:
    """The paper's μ-slip points, from extremes of T_o in the inertia phase, and their curve."""

    element: str
    curve: FrictionCurve
    extremes_time: FloatArray


def estimate_paper_friction(
    signals: ShiftSignals, driveline: KnownDriveline, points: int = 40
) -> PaperFriction:
    """T_c ≈ T_o/i_out (eq. 16) at the extremes of T_o over the inertia phase, slip by eq. 15.

    T_o is averaged over 10 ms windows before its extremes are taken; where it does not oscillate
    (fewer than eight extremes) every window counts. The curve is the points' running mean by slip;
    the Stribeck law is fitted to the points. Raises IdentificationError for a short inertia phase.
    """
    element, span = driveline.oncoming, signals.shift.inertia_phase
    edges = compute_window_edges((span[0] + 0.01, span[1] - 0.005))
    torque = compute_window_means(signals.output_torque, edges)
    pressure = compute_window_means(signals.pressures[element.name], edges)
    time, torque, pressure = drop_nan_rows(0.5 * (edges[1:] + edges[:-1]), torque, pressure)
    slip = np.abs(compute_mean_slip(signals, driveline, time))
    turns = np.flatnonzero(np.diff(np.sign(np.diff(torque))) != 0) + 1
    picked = turns if turns.size >= 8 else np.arange(time.size)
    capacity = element.gain * (pressure[picked] - element.P0.value)
    usable = capacity > 0.0
    picked = picked[usable]
    if picked.size < 5:
        raise IdentificationError(
            f"only {picked.size} points of the inertia phase have pressure above P0",
            "check P0 on the card and the pressure channel of the on-coming element",
        )
    mu = np.abs(torque[picked] / element.b) / capacity[usable]
    order = np.argsort(slip[picked])
    s, m = slip[picked][order], mu[order]
    grid = np.linspace(float(s[0]), float(s[-1]), points)
    bandwidth = float(np.ptp(s)) / np.sqrt(s.size)
    kernel = np.exp(-0.5 * ((grid[:, None] - s) / bandwidth) ** 2)
    smooth = (kernel @ m) / kernel.sum(axis=1)
    nothing = np.full(points, np.nan)
    curve = FrictionCurve(grid, smooth, nothing, nothing, s, m, fit_stribeck_law(s, m), "paper")
    return PaperFriction(element.name, curve, time[picked])


def fit_stribeck_law(slip: FloatArray, mu: FloatArray) -> Stribeck:
    """Stribeck law by least squares on μ-slip points (n,): linear in three, v_s on a grid.

    v_s is at least the smallest slip measured, because the data contain no rise of the law below
    it. mu_c and mu_s are constrained to be nonnegative: with few points the terms are strongly
    correlated, and an unconstrained fit may be unphysical.
    """
    best: tuple[float, FloatArray, float] | None = None
    for v_s in np.geomspace(max(2.0, float(slip.min())), 100.0, 40):
        fall = np.exp(-slip / v_s)
        basis = np.column_stack([1.0 - fall, fall, slip])
        found = lsq_linear(basis, mu, ([0.0, 0.0, -np.inf], np.inf), method="bvls")
        if best is None or found.cost < best[0]:
            best = (float(found.cost), found.x, float(v_s))
    assert best is not None
    mu_c, mu_s, mu_v = (float(v) for v in best[1])
    return Stribeck(mu_c, mu_s, best[2], mu_v)
