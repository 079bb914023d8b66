# SPDX-License-Identifier: MIT
"""η, Je, Jo′ and the delay of the output torque from momentum balances.

In gear g (eq. 10) and, with the output side's torque put in for the slipping element, in the
inertia phase of the shift to h:

    η·T_e - T_o/i_g = (Je + Jo′/i_g²)·ω_e'
    η·T_e - T_o/i_h = Je·ω_e' + (Jo′/i_h)·ω_out'

The equations are linear in (η, Je, Jo′) and hold as long as one element alone carries torque, so
the shift's own speed change excites Je even where the engine torque stands still. The torque
phase is left out: there two unknown torques act. Windows never straddle a phase boundary.
Drum inertias of the shift elements (THEORY section 2) enter as further linear parameters with
their design priors; Jo′ has one too. The delay of the engine torque is estimated with the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM, MomentumSettings, Segment, find_segments
from drivetwin.estimation.data.shift_data import (
    KnownDriveline,
    PreparedLog,
    ShiftData,
    ShiftSignals,
)
from drivetwin.estimation.regression.errors_in_variables import (
    Fit,
    Term,
    build_whitening,
    compute_regressors,
    solve,
)
from drivetwin.estimation.regression.modulating_functions import (
    Kernels,
    Quadrature,
    build_hann_kernels,
    join_windows,
)
from drivetwin.findings import Code, Number, report
from drivetwin.likelihood.measured_signal import estimate_quantization_error
from drivetwin.likelihood.point import Prior
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue, compute_middle

FOUND = (Code.TORQUE_CLOCK_LATE, Code.TORQUE_LATE_OR_SLIP)
"""Findings of the log check on a delay between output torque and speeds."""
PARTS = 6
"""Parts of the found delay at whose ends the balance is computed [count]: those of 30 ms are
shorter than twice the usual delay that the effect allows."""


def align_output_torque(log: PreparedLog) -> PreparedLog:
    """Return the log with the output torque at the stamps that its momentum balance supports.

    The log is returned as it is without a delay that its check has found, where the card states
    the delay, and where the balance hardly improves.
    """
    found = [one for one in log.findings if one.code in FOUND]
    late = [one for one in found if one.names["role"] == "output_torque"]
    if not late or EffectId.OUTPUT_TORQUE_DELAY in log.design.effects:
        return log
    shifts = np.linspace(0.0, late[0].numbers["shift"].value, PARTS + 1)
    try:
        powers = np.array([_compute_power(log, float(shift)) for shift in shifts])
    except IdentificationError:
        return log
    if powers[0] - powers.min() < DELAY.min_rise:
        return log
    best = interpolate_parabola_minimum(shifts, powers)
    moved = report(
        Code.OUTPUT_TORQUE_ALIGNED,
        "",
        late[0].place,
        shift=Number(best, "s"),
        found=late[0].numbers["shift"],
    )
    return replace(
        log,
        shifts=tuple(_move(one, best) for one in log.shifts),
        findings=(*log.findings, moved),
    )


def _compute_power(log: PreparedLog, shift: float) -> float:
    """Compute Q of the momentum balance over all shifts with the output torque moved by `shift`
    [s]."""
    start = compute_middle(log.design.J_prime_range)
    moved = [_move(one, shift) for one in log.shifts]
    fits = [estimate_momentum_inertia(one.signals, one.driveline, MOMENTUM, start) for one in moved]
    return sum(one.fit.q for one in fits)


def _move(one: ShiftData, shift: float) -> ShiftData:
    """Move the output torque of a shift by `shift` [s]."""
    torque = one.signals.output_torque
    moved = replace(torque, time=torque.time + shift)
    signals = replace(one.signals, output_torque=moved, output_torque_shift=shift)
    return replace(one, signals=signals)


@dataclass(frozen=True)
class DelaySettings:
    """Settings of the delay of the engine torque in the momentum balance."""

    max_std: float = 0.005
    """Standard error above which the delay counts as not determined [s]."""
    min_rise: float = 30.0
    """Smallest rise of Q over the scanned delays of a significant minimum [1]."""


DELAY = DelaySettings()


@dataclass(frozen=True, eq=False)
class MomentumFit:
    """Result of the joint regression; `names` are the parameters of `fit.theta`, in order."""

    names: tuple[str, ...]
    fit: Fit

    def get_value(self, name: str) -> float:
        """Estimate of one parameter."""
        return float(self.fit.theta[self.names.index(name)])


def list_momentum_names(signals: ShiftSignals, driveline: KnownDriveline) -> tuple[str, ...]:
    """Parameters of the regression: η, Je, Jo′, delay and mean rounding error of T_e, drums, errors
    of the points of a converter's map."""
    of_speeds = signals.torque_of_speeds
    return (
        "eta",
        "J_e",
        "J_out",
        "te_delay",
        "te_rounding",
        *(f"drum.{c.name}" for c in driveline.drums),
        *(f"map_point.{k}" for k in (() if of_speeds is None else of_speeds.points)),
    )


ROUNDING = 4
"""Index of the mean rounding error of the engine torque [N m] among the parameters."""
FIRST_DRUM = 5
"""Index of the first drum inertia among the parameters."""


class _Equations:
    """Rows of the momentum balance: one window each, with per-row coefficients.

    `u[p]`, `v[p]` (m,) are the coefficients of inertia parameter p on ω_e' and ω_out'. Where the
    gear is locked both sensors show the same motion: they share it by inverse variance.
    """

    def __init__(
        self, signals: ShiftSignals, driveline: KnownDriveline, found: tuple[Segment, ...]
    ) -> None:
        self.signals = signals
        self.windows = join_windows([s.windows for s in found])
        counts = [s.windows.count for s in found]
        self.ratio = np.repeat([s.ratio for s in found], counts)
        tied = np.repeat([s.tied for s in found], counts)
        constant = Quadrature(csr_array(0.5 * self.windows.width[:, None]))
        self.errors = {ROUNDING: (np.ones(1), constant)}
        of_speeds = signals.torque_of_speeds
        if of_speeds is not None:
            quadrature = build_hann_kernels(of_speeds.time, self.windows).psi
            first = FIRST_DRUM + len(driveline.drums)
            points = enumerate(of_speeds.points.values(), start=first)
            self.errors |= {k: (one, quadrature) for k, one in points}
        self.torque = build_hann_kernels(signals.output_torque.time, self.windows).psi
        self.engine = build_hann_kernels(signals.engine_speed.time, self.windows).slope
        self.output = build_hann_kernels(signals.output_speed.time, self.windows).slope
        one, zero = np.ones_like(self.ratio), np.zeros_like(self.ratio)
        raw = {1: (one, zero), 2: (zero, 1.0 / self.ratio)}
        for k, c in enumerate(driveline.drums):
            net = c.a - c.b / self.ratio
            raw[FIRST_DRUM + k] = (c.a * net, -c.b * net)
        variance_e = signals.engine_speed.sigma**2
        variance_o = (self.ratio * signals.output_speed.sigma) ** 2
        share = variance_o / (variance_e + variance_o)
        self.u = {p: np.where(tied, share * (u + v / self.ratio), u) for p, (u, v) in raw.items()}
        self.v = {
            p: np.where(tied, (1.0 - share) * (self.ratio * u + v), v) for p, (u, v) in raw.items()
        }

    def engine_torque(self, theta: FloatArray, kernels: Kernels | None = None) -> Term:
        """The part η·T_e, its stamps taken θ[3] seconds after the instant they show."""
        torque = self.signals.engine_torque
        kernels = kernels or build_hann_kernels(torque.time, self.windows, theta[3])
        factor = np.full_like(self.ratio, theta[0])
        slopes = {0: (np.ones_like(self.ratio), kernels.psi), 3: (factor, kernels.slope)}
        return Term(torque.values, torque.sigma, kernels.psi, factor, slopes)

    def others(self, theta: FloatArray) -> list[Term]:
        """The parts -T_o/i, -u·ω_e' and -v·ω_out'."""
        terms = [
            Term(
                self.signals.output_torque.values,
                self.signals.output_torque.sigma,
                self.torque,
                -1.0 / self.ratio,
                {},
            )
        ]
        for signal, quadrature, coefficients in (
            (self.signals.engine_speed, self.engine, self.u),
            (self.signals.output_speed, self.output, self.v),
        ):
            factor = np.zeros_like(self.ratio)
            for p, c in coefficients.items():
                factor = factor - theta[p] * c
            slopes = {p: (-c, quadrature) for p, c in coefficients.items()}
            terms.append(Term(signal.values, signal.sigma, quadrature, factor, slopes))
        return terms

    def list_errors(self, theta: FloatArray) -> list[Term]:
        """The parts of the engine torque's errors, -η·θ[p] of each."""
        found = []
        for p, (error, quadrature) in self.errors.items():
            factor = np.full_like(self.ratio, -theta[0] * theta[p])
            slopes = {
                0: (np.full_like(self.ratio, -theta[p]), quadrature),
                p: (np.full_like(self.ratio, -theta[0]), quadrature),
            }
            found.append(Term(error, 0.0, quadrature, factor, slopes))
        return found

    def terms(self, theta: FloatArray) -> list[Term]:
        """Build the terms of the equations at θ, the engine torque first."""
        return [self.engine_torque(theta), *self.others(theta), *self.list_errors(theta)]


def _build_priors(
    signals: ShiftSignals, driveline: KnownDriveline, settings: MomentumSettings
) -> dict[str, PriorValue]:
    """Build the priors of the parameters, by name."""
    rounding = estimate_quantization_error(signals.engine_torque, signals.torque_resolution)
    delay = driveline.known.get("te_delay", settings.delay_prior)
    found = {"te_delay": delay, "te_rounding": PriorValue(0.0, rounding)}
    of_speeds = signals.torque_of_speeds
    if of_speeds is not None:
        points = of_speeds.point_std.items()
        found |= {f"map_point.{k}": PriorValue(0.0, std) for k, std in points}
    if driveline.J_out is not None:
        found["J_out"] = driveline.J_out
    return found | {f"drum.{one.name}": one.drum for one in driveline.drums}


def _compute_prior_std(prior: PriorValue) -> float:
    """Standard deviation of a prior; a known value gets one too small to matter."""
    return prior.std if prior.std > 0.0 else 1e-6 * max(abs(prior.value), 1e-6)


def _scan_delays(
    equations: _Equations, theta: FloatArray, prior: Prior, delays: FloatArray
) -> FloatArray:
    """Q (n,) over the delay of the engine torque (n,), the other parameters fitted at each delay.

    The weighting is that at `theta`; the equations are then linear in the rest.
    """
    terms = equations.terms(theta)
    whiten = build_whitening(terms)
    free = [p for p in range(theta.size) if p not in (0, 3)]
    fixed = terms[1].factor * (terms[1].quadrature.matrix @ terms[1].values)
    rest = whiten(np.column_stack([fixed, compute_regressors(terms[1:], theta.size)[:, free]]))
    torque = equations.signals.engine_torque
    drives = [
        build_hann_kernels(torque.time, equations.windows, delay).psi.matrix @ torque.values
        for delay in delays.tolist()
    ]
    weight = np.sqrt(np.diag(prior.precision))[free]
    ties = np.column_stack([-weight * prior.mean[free], np.diag(weight)])
    rows = np.vstack([rest, ties])
    pad = np.zeros(weight.size)
    q = []
    for drive in whiten(np.column_stack(drives)).T:
        design = np.column_stack([np.concatenate([drive, pad]), rows[:, 1:]])
        solution = np.linalg.lstsq(design, -rows[:, 0], rcond=None)[0]
        q.append(float(np.sum((design @ solution + rows[:, 0]) ** 2)))
    return np.asarray(q)


def interpolate_parabola_minimum(x: FloatArray, y: FloatArray) -> float:
    """Abscissa of the minimum of y (n,) over equidistant x (n,), by a parabola through three."""
    k = int(np.argmin(y))
    if k in (0, x.size - 1):
        return float(x[k])
    left, middle, right = y[k - 1 : k + 2]
    bend = left - 2.0 * middle + right
    return float(x[k] + 0.5 * (x[k + 1] - x[k]) * (left - right) / bend)


def estimate_momentum_inertia(
    signals: ShiftSignals,
    driveline: KnownDriveline,
    settings: MomentumSettings,
    start_inertia: float,
) -> MomentumFit:
    """Estimate η, Je, Jo′, delay of T_e and drums over the whole shift, with their covariance.

    `start_inertia` [kg m^2] is any value within the plausible range of J′.
    """
    found = find_segments(signals, driveline, settings)
    equations = _Equations(signals, driveline, found)
    names = list_momentum_names(signals, driveline)
    priors = _build_priors(signals, driveline, settings)
    entries = {
        names.index(name): (one.value, _compute_prior_std(one)) for name, one in priors.items()
    }
    prior = Prior.from_independent(len(names), entries)
    start = prior.mean.copy()
    start[:2] = 0.9, start_inertia
    first = solve(equations.terms, start, prior.fix_parameter(3, start[3]), tolerance=0.1)
    delays = np.asarray(settings.delay_grid)
    powers = _scan_delays(equations, first.theta, prior, delays)
    theta = first.theta.copy()
    theta[3] = interpolate_parabola_minimum(delays, powers)
    fit = solve(equations.terms, theta, prior)
    if fit.std[3] >= DELAY.max_std or float(np.ptp(powers)) <= DELAY.min_rise:
        fit = solve(equations.terms, first.theta, prior.fix_parameter(3, start[3]))
    return MomentumFit(names, fit)
