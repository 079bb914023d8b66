# SPDX-License-Identifier: MIT
"""Friction coefficient over slip of the on-coming element, the paper's way and in momentum form.

Inertia phase, exact form of eq. 16:       T_c = (T_o + Jo′·ω_out')/i_out
Torque phase, off-going element locked:    κ·T_c = η·T_e - T_o/i_g - J′·ω_e',  κ = a - b/i_g
Both: T_c = sgn(s)·μ(|s|)·gain·(P - P0), slip s by eq. 15. The torque phase contains the
torque at low pressure, which separates P0 from μ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray, Span, propagate_variance
from drivetwin._util.signal_processing import compute_moving_mean
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, MeasuredSignal, ShiftSignals
from drivetwin.estimation.linear.momentum_balance import FIRST_DRUM, MomentumFit, compute_prior_std
from drivetwin.estimation.regression.errors_in_variables import Fit, Prior, Term, solve
from drivetwin.estimation.regression.modulating_functions import (
    Quadrature,
    Windows,
    build_hann_kernels,
    build_windows,
    join_windows,
)
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.shifts.coverage import split_at_gaps
from drivetwin.simulation.dual_clutch import Stribeck

MU_C, MU_DROP, MU_V, LOG_V, P0 = range(5)
NUISANCE = 5
"""From here on the parameters of the momentum fit follow, with its covariance as prior."""
LAW_PRIOR = {MU_C: (0.12, 0.2), MU_DROP: (0.0, 0.1), MU_V: (0.0, 2e-3), LOG_V: (np.log(15.0), 1.0)}
"""Wide priors of the Stribeck law: wet clutch facings; v_s within a factor e of 15 rad/s."""


@dataclass(frozen=True)
class FrictionSettings:
    """Windows of the friction fit [s], distance from phase boundaries and from the fill point."""

    width: float = 0.03
    step: float = 0.0075
    margin: float = 0.012
    fill_margin: float = 5e3
    """Pressure [Pa] above P0 from which an element counts as filled."""


FRICTION = FrictionSettings()


@dataclass(frozen=True, eq=False)
class FrictionFit:
    """Stribeck law and P0 of one element; `fit.theta` is (mu_c, mu_s - mu_c, mu_v, ln v_s, P0, …).

    `curve` is what the report shows; `torque_phase` (n,) marks its points from the torque phase.
    """

    element: str
    fit: Fit
    curve: FrictionCurve
    torque_phase: FloatArray

    @property
    def P0(self) -> float:
        """Pressure at which the fill ends [Pa]."""
        return float(self.fit.theta[P0])

    @property
    def P0_std(self) -> float:
        """Its standard error [Pa]."""
        return float(self.fit.std[P0])


def evaluate_stribeck(theta: FloatArray, slip: FloatArray) -> tuple[FloatArray, FloatArray]:
    """μ (n,) over |slip| (n,) and its derivatives (4, n) by (mu_c, mu_drop, mu_v, ln v_s)."""
    mu_c, drop, mu_v, ln_v_s = (float(theta[k]) for k in (MU_C, MU_DROP, MU_V, LOG_V))
    law = Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v)
    return law.evaluate(slip), law.compute_slopes(slip)


def build_law_derivatives(v_s: float) -> FloatArray:
    """Derivatives (4, 4) of mu_c, mu_s, v_s, mu_v by (mu_c, mu_drop, mu_v, ln v_s)."""
    return np.array([[1.0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, v_s], [0, 0, 1, 0]])


def evaluate_fitted_stribeck(fit: FrictionFit, slip: FloatArray) -> FloatArray:
    """μ (n,) of a fitted law over |slip| (n,)."""
    return evaluate_stribeck(fit.fit.theta, slip)[0]


def compute_mean_slip(
    signals: ShiftSignals, driveline: KnownDriveline, time: FloatArray
) -> FloatArray:
    """Slip of the on-coming element (eq. 15) [rad/s] at `time` (n,), over 11 samples' mean."""

    def smooth(signal: MeasuredSignal) -> FloatArray:
        return np.interp(time, signal.time, compute_moving_mean(signal.values, 11))

    element = driveline.oncoming
    engine, output = smooth(signals.engine_speed), smooth(signals.output_speed)
    return element.a * engine - element.b * output


def _find_fill_end(
    signals: ShiftSignals, driveline: KnownDriveline, settings: FrictionSettings
) -> float:
    """Instant of the shift from which the on-coming element is surely filled [s].

    It comes after break-away where that element only takes hold at the other gear's speed.
    """
    element = driveline.oncoming
    pressure = signals.pressures[element.name]
    limit = element.P0.value + 2.0 * element.P0.std + settings.fill_margin
    smooth = compute_moving_mean(pressure.values, 9)
    start, end = signals.shift.before[1], signals.shift.lockup_time
    inside = (pressure.time >= start) & (pressure.time <= end)
    below = pressure.time[inside & (smooth < limit)]
    return float(below[-1]) if below.size else start


def _find_friction_spans(
    signals: ShiftSignals, driveline: KnownDriveline, free: float, settings: FrictionSettings
) -> tuple[Span, Span]:
    """Spans of the torque phase and of the inertia phase that carry an equation."""
    shift = signals.shift
    sigma = shift.sigma
    clear = settings.margin + 3.0 * sigma.get("inertia_start", 0.0)
    filled = _find_fill_end(signals, driveline, settings)
    torque = (filled, shift.inertia_phase[0] - clear)
    lockup = shift.lockup_time - settings.margin - 3.0 * sigma.get("lockup", 0.0)
    return torque, (max(free, filled, shift.inertia_phase[0] + clear), lockup)


def _build_gapless_windows(
    signals: ShiftSignals, span: Span, settings: FrictionSettings
) -> Windows:
    """Windows in a span that touch no gap of the outputs."""
    parts = split_at_gaps(span, signals.output_gaps)
    return join_windows([build_windows(part, settings.width, settings.step) for part in parts])


class _Equations:
    """Rows in T_c [N m·s]: windows of the torque phase first, then of the inertia phase."""

    def __init__(
        self,
        signals: ShiftSignals,
        driveline: KnownDriveline,
        momentum: MomentumFit,
        spans: tuple[Span, Span],
        settings: FrictionSettings,
    ) -> None:
        parts = [_build_gapless_windows(signals, span, settings) for span in spans]
        if parts[1].count < 5:
            raise IdentificationError(
                f"the inertia phase leaves {parts[1].count} windows of {settings.width:g} s",
                "log a slower shift, or one with the off-going element vented earlier",
            )
        self.windows: Windows = join_windows(parts)
        self.in_torque_phase = np.repeat([True, False], [p.count for p in parts])
        self.signals, self.element = signals, driveline.oncoming
        pressure = signals.pressures[self.element.name]
        self.pressure = pressure
        self.kernel = build_hann_kernels(pressure.time, self.windows).psi
        self.slip = compute_mean_slip(signals, driveline, pressure.time)
        te, to = signals.engine_torque, signals.output_torque
        we, wo = signals.engine_speed, signals.output_speed
        delay = momentum.get_value("te_delay")
        self.te = build_hann_kernels(te.time, self.windows, delay).psi
        self.to = build_hann_kernels(to.time, self.windows).psi
        self.we = build_hann_kernels(we.time, self.windows).slope
        self.wo = build_hann_kernels(wo.time, self.windows).slope
        self._coefficients(driveline)

    def _coefficients(self, driveline: KnownDriveline) -> None:
        """Coefficients (m,) of each measured integral in T_c, by parameter of the momentum fit."""
        a, b, i = self.element.a, self.element.b, driveline.i_before
        share = a - b / i
        tp = self.in_torque_phase
        zero = np.zeros(tp.size)
        self.by_eta = np.where(tp, 1.0 / share, zero)
        self.by_to = np.where(tp, -1.0 / (i * share), 1.0 / b)
        self.by_we = {
            1: np.where(tp, -1.0 / share, zero),
            2: np.where(tp, -1.0 / (i * i * share), zero),
        }
        self.by_wo = {2: np.where(tp, zero, 1.0 / b)}
        for k, c in enumerate(driveline.drums):
            locked = -((c.a - c.b / i) ** 2) / share
            self.by_we[FIRST_DRUM + k] = np.where(tp, locked, -c.a * c.b / b)
            self.by_wo[FIRST_DRUM + k] = np.where(tp, zero, c.b * c.b / b)

    def measured(self, nuisance: FloatArray) -> list[Term]:
        """T_c as the torques and speeds show it."""
        s = self.signals
        one = np.ones_like(self.by_eta)
        terms = [
            Term(
                s.engine_torque.values,
                s.engine_torque.sigma,
                self.te,
                nuisance[0] * self.by_eta,
                {NUISANCE: (self.by_eta, self.te)},
            ),
            Term(s.output_torque.values, s.output_torque.sigma, self.to, self.by_to, {}),
        ]
        for signal, quadrature, by in (
            (s.engine_speed, self.we, self.by_we),
            (s.output_speed, self.wo, self.by_wo),
        ):
            factor = 0.0 * one
            for p, c in by.items():
                factor = factor + nuisance[p] * c
            slopes = {NUISANCE + p: (c, quadrature) for p, c in by.items()}
            terms.append(Term(signal.values, signal.sigma, quadrature, factor, slopes))
        return terms

    def weighted(self, weight: FloatArray) -> Quadrature:
        """∫ψ·weight·gain·x dt over the pressure's samples; `weight` (n,) by sample."""
        k = self.kernel.matrix
        data = k.data * (self.element.gain * weight * np.sign(self.slip))[k.indices]
        return Quadrature(csr_array((data, k.indices, k.indptr), shape=k.shape))

    def terms(self, theta: FloatArray) -> list[Term]:
        """T_c measured minus μ(s)·gain·(P - P0)."""
        mu, slopes = evaluate_stribeck(theta, self.slip)
        law = self.weighted(mu)
        by_law = {p: self.weighted(slope) for p, slope in enumerate(slopes)}
        one = np.ones_like(self.by_eta)
        pressure = Term(
            self.pressure.values,
            self.pressure.sigma,
            law,
            -one,
            {p: (-one, k) for p, k in by_law.items()},
        )
        fill = Term(
            np.ones_like(self.pressure.values),
            0.0,
            law,
            theta[P0] * one,
            {P0: (one, law), **{p: (theta[P0] * one, k) for p, k in by_law.items()}},
        )
        return [*self.measured(theta[NUISANCE:]), pressure, fill]


def _build_prior(driveline: KnownDriveline, momentum: MomentumFit) -> Prior:
    """Wide law priors, the design P0, and the momentum fit with its covariance."""
    size = NUISANCE + len(momentum.names)
    fill = driveline.oncoming.P0
    prior = Prior.from_independent(size, {**LAW_PRIOR, P0: (fill.value, compute_prior_std(fill))})
    prior.mean[NUISANCE:] = momentum.fit.theta
    cov = momentum.fit.covariance
    scale = np.sqrt(np.diag(cov))
    prior.precision[NUISANCE:, NUISANCE:] = np.linalg.inv(cov / np.outer(scale, scale)) / np.outer(
        scale, scale
    )
    return prior


def fit_momentum_friction(
    signals: ShiftSignals,
    driveline: KnownDriveline,
    momentum: MomentumFit,
    free: float,
    settings: FrictionSettings,
) -> FrictionFit:
    """Fit the Stribeck law and P0 of the on-coming element; `free`: off-going element vented [s].

    Raises IdentificationError where the inertia phase is too short, or friction comes out negative.
    """
    spans = _find_friction_spans(signals, driveline, free, settings)
    equations = _Equations(signals, driveline, momentum, spans, settings)
    prior = _build_prior(driveline, momentum)
    fits = []
    for scale in (4.0, 12.0, 36.0):
        start = prior.mean.copy()
        start[LOG_V] = np.log(scale)
        fits.append(solve(equations.terms, start, prior, tolerance=0.02))
    fit = min(fits, key=lambda f: f.q + prior.compute_prior_cost(f.theta))
    return _describe_fit(equations, fit)


def _describe_fit(equations: _Equations, fit: Fit) -> FrictionFit:
    kernel = equations.kernel.matrix
    area = 0.5 * equations.windows.width
    slip = np.abs(kernel @ equations.slip) / area
    torque = sum(
        (
            t.factor * (t.quadrature.matrix @ t.values)
            for t in equations.measured(fit.theta[NUISANCE:])
        ),
        np.zeros_like(area),
    )
    above = kernel @ (equations.pressure.values - fit.theta[P0])
    sign = np.sign(kernel @ equations.slip)
    mu_points = sign * torque / (equations.element.gain * above)
    grid = np.linspace(float(slip.min()), float(slip.max()), 60)
    mu, slopes = evaluate_stribeck(fit.theta, grid)
    std = np.sqrt(propagate_variance(slopes.T, fit.covariance[:4, :4]))
    v_s = float(np.exp(fit.theta[LOG_V]))
    law = Stribeck(
        mu_c=float(fit.theta[MU_C]),
        mu_s=float(fit.theta[MU_C] + fit.theta[MU_DROP]),
        v_s=v_s,
        mu_v=float(fit.theta[MU_V]),
    )
    least = min(float(mu.min()), law.mu_c, law.mu_s)
    if least <= 0.0:
        raise IdentificationError(
            f"the friction of {equations.element.name} comes out as μ = {least:.3g}",
            "torques, pressures and speeds contradict each other: check signs, units and delays",
        )
    to_law = build_law_derivatives(v_s)
    curve = FrictionCurve(
        slip=grid,
        mu=mu,
        mu_lo=mu - Z95 * std,
        mu_hi=mu + Z95 * std,
        points_slip=slip,
        points_mu=mu_points,
        stribeck=law,
        method="integral",
        stribeck_covariance=to_law @ fit.covariance[:4, :4] @ to_law.T,
    )
    return FrictionFit(
        equations.element.name, fit, curve, equations.in_torque_phase.astype(np.float64)
    )
