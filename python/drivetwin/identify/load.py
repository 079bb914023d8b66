# SPDX-License-Identifier: MIT
"""Load torque T_v/i_f and vehicle inertia J3 (eq. 11), the paper's way and in momentum form.

T_o - T_v/i_f = (J3/i_f)·ω_w'
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from drivetwin.errors import IdentificationError
from drivetwin.identify.modulating import Quadrature, hann_kernels, join, windows_in
from drivetwin.identify.regression import Fit, Prior, Term, solve
from drivetwin.identify.signals import FloatArray, Sampled, ShiftSignals, Span
from drivetwin.identify.wlse import (
    GridFit,
    GridRow,
    Weighting,
    central_difference,
    weighted_inertia,
    whole,
    window_edges,
    window_means,
)
from drivetwin.shifts.recorded import parts_between


@dataclass(frozen=True)
class PaperLoadSettings:
    """Two-stage grid of T_v/i_f [N m] and weighting of the paper; J3 range in kg·m²."""

    weighting: Weighting
    stop: float = 4000.0
    coarse: float = 500.0
    fine: float = 100.0


def paper_load(
    signals: ShiftSignals, i_f: float, span: Span, settings: PaperLoadSettings
) -> GridFit:
    """Search T_v/i_f from 0 to `stop` in coarse steps, then in fine ones around the best.

    The RMS error is that of eq. 11 divided by i_f: a torque at the output shaft [N m]. Without a
    wheel-speed channel the output speed divided by i_f stands in for it.
    """
    edges = window_edges(span)
    if signals.wheel_speed is not None:
        speed = window_means(signals.wheel_speed, edges)
    else:
        speed = window_means(signals.output_speed, edges) / i_f
    acceleration = central_difference(speed)
    output_torque = window_means(signals.output_torque, edges)[1:-1]
    acceleration, output_torque = whole(acceleration, output_torque)

    def row(load: float) -> GridRow:
        torque = output_torque - load
        slope, _ = weighted_inertia(torque, acceleration, settings.weighting, scale=i_f)
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
    _, weights = weighted_inertia(torque, acceleration, settings.weighting, scale=i_f)
    return GridFit(rows, best, acceleration, torque, output_torque - rows[0].value, weights)


WIDTH = 0.4
"""Width of a window [s]."""
UNKNOWNS = 3
"""Load, inertia and the part of the load that grows with speed."""
SETTLING = 0.5
"""Time after lock-up [s] in which the output speed cannot stand in for the wheel speed."""


@dataclass(frozen=True, eq=False)
class LoadFit:
    """Regression of eq. 11: θ = (T_v/i_f, J3) in `fit`.

    Evidence, one entry per window: `time` [s], `torque` = mean T_o - T_v/i_f [N m],
    `acceleration` = mean ω_w' [rad/s^2]. `mean_speed` is that of the wheel [rad/s];
    `speed_trend` the t value of a residual proportional to the speed's deviation from it.
    """

    fit: Fit
    time: FloatArray
    torque: FloatArray
    acceleration: FloatArray
    mean_speed: float
    speed_trend: float

    @property
    def load(self) -> float:
        """T_v/i_f [N m]."""
        return float(self.fit.theta[0])

    @property
    def J_vehicle(self) -> float:
        """J3 at the wheel [kg m^2]."""
        return float(self.fit.theta[1])


def load_left(torque: Sampled, wheel: Sampled, i_f: float, span: Span) -> float:
    """Noise power (1: noise alone) that eq. 11 leaves over `span` [s] with the best load.

    The load is constant but for a part that grows with the square of the speed `wheel` [rad/s].
    Much more than noise is left where something else moves the vehicle: brake, change of grade.
    Infinite where the span holds nothing to tell it from.
    """
    parts = parts_between(span, (*torque.unrecorded, *wheel.unrecorded))
    windows = join([windows_in(part, WIDTH, WIDTH / 16.0) for part in parts])
    if windows.count <= UNKNOWNS:
        return float("inf")
    psi = hann_kernels(torque.time, windows).psi
    kernels = hann_kernels(wheel.time, windows)
    area, one = 0.5 * windows.width, np.ones(windows.count)
    constant = Quadrature(csr_array(area[:, None]))
    square = wheel.at(windows.centre) ** 2
    grown = (square - square.mean()) / max(float(np.ptp(square)), np.finfo(float).tiny)

    def terms(theta: FloatArray) -> list[Term]:
        load = -(theta[0] + theta[2] * grown)
        inertia = {1: (-one / i_f, kernels.slope)}
        return [
            Term(torque.values, torque.sigma, psi, one, {}),
            Term(np.ones(1), 0.0, constant, load, {0: (-one, constant), 2: (-grown, constant)}),
            Term(wheel.values, wheel.sigma, kernels.slope, -theta[1] / i_f * one, inertia),
        ]

    try:
        return solve(terms, np.zeros(UNKNOWNS), Prior.independent(UNKNOWNS, {})).chi2
    except IdentificationError:
        return float("inf")


def momentum_load(
    signals: ShiftSignals, i_f: float, spans: tuple[Span, ...], width: float = WIDTH
) -> LoadFit:
    """Estimate (T_v/i_f, J3) from ∫ψ·T_o - (T_v/i_f)·∫ψ = (J3/i_f)·∫ψ·ω_w' over all windows.

    Eq. 11 knows no gear, so `spans` may cover the whole log where the wheel speed is measured.
    Raises IdentificationError where torque and speed do not determine both.
    """
    wheel = signals.wheel_speed
    speed = signals.output_speed if wheel is None else wheel
    gaps = (*speed.unrecorded, *signals.output_torque.unrecorded)
    parts = [part for span in spans for part in parts_between(span, gaps)]
    windows = join([windows_in(part, width, width / 16.0) for part in parts])
    if not windows.count:
        raise IdentificationError(
            f"no {width:g} s of held gear without a gap for the balance of the vehicle",
            "record at least a second before and after the shift",
        )
    scale = i_f**-2 if wheel is None else 1.0 / i_f
    torque = signals.output_torque
    psi = hann_kernels(torque.time, windows).psi
    slope = hann_kernels(speed.time, windows).slope
    area = 0.5 * windows.width
    one = np.ones(windows.count)
    constant = Quadrature(csr_array(area[:, None]))

    def terms(theta: FloatArray) -> list[Term]:
        inertia = {1: (-scale * one, slope)}
        return [
            Term(torque.values, torque.sigma, psi, one, {}),
            Term(np.ones(1), 0.0, constant, -theta[0] * one, {0: (-one, constant)}),
            Term(speed.values, speed.sigma, slope, -theta[1] * scale * one, inertia),
        ]

    start = np.array([float(np.mean(torque.values)), 1.0])
    fit = solve(terms, start, Prior.independent(2, {}))
    ratio = 1.0 if wheel is not None else 1.0 / i_f
    local = speed.at(windows.centre) * ratio
    centred = local - local.mean()
    z = fit.residual / fit.residual_std
    spread = float(np.sqrt(np.sum(centred**2)))
    overlap = np.sqrt(width / (width / 16.0) * 0.375)
    return LoadFit(
        fit,
        windows.centre,
        (psi.matrix @ torque.values) / area - fit.theta[0],
        (slope.matrix @ speed.values) * ratio / area,
        float(local.mean()),
        float(z @ centred) / (spread * overlap) if spread > 0.0 else 0.0,
    )
