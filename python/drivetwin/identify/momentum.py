# SPDX-License-Identifier: MIT
"""η, Je and Jo′ from the momentum balance through gear, inertia phase and next gear.

In gear g (eq. 10) and, with the output side's torque put in for the slipping element, in the
inertia phase of the shift to h:

    η·T_e - T_o/i_g = (Je + Jo′/i_g²)·ω_e'
    η·T_e - T_o/i_h = Je·ω_e' + (Jo′/i_h)·ω_out'

The equations are linear in (η, Je, Jo′) and hold as long as one element alone carries torque, so
the shift's own speed change excites Je even where the engine torque stands still. The torque
phase is left out: there two unknown torques act. Windows never straddle a phase boundary.
Drum inertias of the shift elements (THEORY section 2) enter as further linear parameters with
their design priors; Jo′ has one too. The age of the engine torque is estimated with the rest.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_array

from drivetwin.errors import IdentificationError
from drivetwin.identify.modulating import (
    Kernels,
    Quadrature,
    Windows,
    hann_kernels,
    join,
    windows_in,
)
from drivetwin.identify.regression import Fit, Prior, Term, regressors, solve, whitening
from drivetwin.identify.signals import Driveline, FloatArray, Sampled, ShiftSignals, Span
from drivetwin.shifts.recorded import parts_between
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class MomentumSettings:
    """Windows and priors of the momentum form; times in s.

    `width`, `step` of the Hann windows; in a phase shorter than two widths the window is
    `share` of the phase. `margin` keeps clear of lock and break-away. `delay_prior` is the
    plausible age of an engine torque value on a CAN bus; `delay_grid` the ages scanned.
    """

    width: float = 0.4
    step: float = 0.025
    share: float = 0.4
    margin: float = 0.01
    delay_prior: PriorValue = field(default_factory=lambda: PriorValue(0.02, 0.03))
    delay_grid: tuple[float, ...] = tuple(np.linspace(-0.02, 0.08, 21).tolist())

    def guard(self, boundary: str, shift: Shift) -> float:
        """Distance kept from a phase boundary [s]: the margin and three standard deviations."""
        return self.margin + 3.0 * shift.sigma.get(boundary, 0.0)


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of the log where one momentum equation holds.

    `ratio` is i_g or i_h; `tied` says that the gear is locked, so ω_e = ratio·ω_out.
    """

    name: str
    span: Span
    ratio: float
    tied: bool
    windows: Windows


SMOOTH = 5
"""Samples over which a pressure is averaged before it is held against a limit."""
VENTED = 0.5
"""Share of P0 below which a pressure that is left after lock-up means an empty element."""
LEAST_SPAN = 0.05
"""A shorter stretch [s] holds no window that says anything."""
LEAST_BESIDE = 0.25
"""A gear held for less [s] beside a gap has windows that a torque as late as it may be leaves."""
DELAY_STD_MAX = 0.005
"""Standard error [s] above which the age of the engine torque is taken as not shown."""
NO_ROUNDING = 1e-3
"""Mean error of rounding over the noise of a sample that counts as none: a thousand samples leave
thirty times as much in their mean."""
DELAY_Q_MIN = 30.0
"""Least rise of Q over the scanned ages for the minimum to mean anything."""


@dataclass(frozen=True, eq=False)
class DelayScan:
    """Q of the regression over the assumed age of the engine torque: `delay` [s], `q`, (n,).

    `best` is the age at the minimum, None where the engine torque moves too little to show it.
    """

    delay: FloatArray
    q: FloatArray
    best: float | None

    def tells(self, std: float) -> bool:
        """Whether the engine torque moves enough to show its age, to `std` [s]."""
        return std < DELAY_STD_MAX and float(np.ptp(self.q)) > DELAY_Q_MIN


@dataclass(frozen=True, eq=False)
class MomentumFit:
    """Result of the joint regression. `names` are the parameters of `fit.theta`, in order,
    `priors` what was known of them beforehand, by name.

    Evidence for the report, one entry per window: `time` [s], `stretch` name, `drive` = mean
    η·T_e - T_o/i [N m] and `acceleration` [rad/s^2] over the window, `inertia_torque` the fitted
    right-hand side [N m].
    """

    names: tuple[str, ...]
    priors: Mapping[str, PriorValue]
    fit: Fit
    scan: DelayScan
    time: FloatArray
    stretch: tuple[str, ...]
    drive: FloatArray
    acceleration: FloatArray
    inertia_torque: FloatArray

    def index(self, name: str) -> int:
        """Position of a parameter in `fit.theta`."""
        return self.names.index(name)

    def value(self, name: str) -> float:
        """Estimate of one parameter."""
        return float(self.fit.theta[self.index(name)])

    def std(self, name: str) -> float:
        """Standard error of one parameter."""
        return float(self.fit.std[self.index(name)])


def momentum_names(driveline: Driveline) -> tuple[str, ...]:
    """Parameters of the regression: η, Je, Jo′, age and mean rounding error of T_e, drums."""
    return (
        "eta",
        "J_e",
        "J_out",
        "te_delay",
        "te_rounding",
        *(f"drum.{c.name}" for c in driveline.drums),
    )


def off_going_free(
    signals: ShiftSignals, driveline: Driveline, settings: MomentumSettings
) -> float:
    """First instant of the inertia phase at which the off-going element carries nothing [s].

    Its pressure must have fallen for good below P0, less two standard deviations of P0. Where P0
    is so little known, or so low, that no pressure is below that, it must have fallen to what is
    left of it after lock-up.
    """
    shift = signals.shift
    start = shift.inertia_phase[0] + settings.guard("inertia_start", shift)
    element = driveline.offgoing
    pressure = signals.pressures[element.name]
    limit = element.P0.value - 2.0 * element.P0.std
    rest, margin = _vented(pressure, shift)
    if limit < rest + margin and rest < max(VENTED * element.P0.value, margin):
        limit = rest + margin
    smooth = np.convolve(pressure.values, np.ones(SMOOTH) / SMOOTH, mode="same")
    inside = (pressure.time >= start) & (pressure.time < shift.lockup_time)
    held = pressure.time[inside & (smooth >= limit)]
    return float(held[-1]) if held.size else start


def _vented(pressure: Sampled, shift: Shift) -> tuple[float, float]:
    """What is left of an off-going pressure after lock-up [Pa], and how near is as good as there:
    what noise makes of a mean of so many samples, and a hundredth of the whole fall."""
    spans = (np.linspace(*span, 100) for span in (shift.before, shift.after))
    before, rest = (float(np.median(pressure.at(time))) for time in spans)
    return rest, 5.0 * pressure.sigma / float(np.sqrt(SMOOTH)) + 0.01 * abs(before - rest)


def _driving(torque: Sampled, windows: Windows) -> Windows:
    """The windows in which torque flows from engine to wheels throughout.

    Elsewhere the dissipative loss law has another efficiency (THEORY section 3). The output
    torque, averaged over 21 samples, must stay four standard errors above zero.
    """
    mean = np.convolve(torque.values, np.ones(21) / 21.0, mode="same")
    reversed_at = torque.time[mean < 4.0 * torque.sigma / np.sqrt(21.0)]
    first = np.searchsorted(reversed_at, windows.start)
    last = np.searchsorted(reversed_at, windows.start + windows.width)
    keep = first == last
    return Windows(windows.start[keep], windows.width[keep])


def stretches(
    signals: ShiftSignals, driveline: Driveline, settings: MomentumSettings
) -> tuple[Stretch, ...]:
    """The stretches of a shift that carry an equation, with their windows."""
    shift = signals.shift
    lockup = settings.guard("lockup", shift)
    free = off_going_free(signals, driveline, settings)
    spans = (
        (
            "before",
            (shift.before[0], shift.before[1] - settings.guard("torque_start", shift)),
            True,
        ),
        ("inertia", (free, shift.lockup_time - lockup), False),
        ("after", (shift.lockup_time + lockup, shift.after[1]), True),
    )
    found, backwards = [], False
    for name, span, tied in spans:
        ratio = driveline.i_before if name == "before" else driveline.i_after
        for part in parts_between(span, signals.output_gaps):
            if tied and part != span and part[1] - part[0] < LEAST_BESIDE:
                continue
            windows = _windows(part, settings)
            if driveline.loss_law == "dissipative" and windows.count:
                windows = _driving(signals.output_torque, windows)
                backwards = backwards or not windows.count
            if windows.count:
                found.append(Stretch(name, part, ratio, tied, windows))
    if backwards and not found:
        raise IdentificationError(
            "nowhere does torque flow from the engine to the wheels throughout, which the momentum "
            "balance by the dissipative loss law needs",
            "use the likelihood method, or record a second with the pedal down beside the shift",
        )
    if not found:
        raise IdentificationError(
            "no stretch of the log is long enough for the momentum balance",
            "record at least 0.5 s before and after the shift",
        )
    return tuple(found)


def _windows(span: Span, settings: MomentumSettings) -> Windows:
    """Windows over a span, narrower ones where it is short; none below LEAST_SPAN."""
    length = span[1] - span[0]
    if length < LEAST_SPAN:
        return windows_in(span, np.inf, settings.step)
    short = length < 2.0 * settings.width
    width = settings.share * length if short else settings.width
    return windows_in(span, width, settings.step * width / settings.width)


ROUNDING = 4
"""Index of the mean rounding error of the engine torque [N m] among the parameters."""
FIRST_DRUM = 5
"""Index of the first drum inertia among the parameters."""


class _Equations:
    """All rows of the momentum balance: one window each, with per-row coefficients.

    `u[p]`, `v[p]` (m,) are the coefficients of inertia parameter p on ω_e' and ω_out'. Where the
    gear is locked both sensors show the same motion: they share it by inverse variance.
    """

    def __init__(
        self, signals: ShiftSignals, driveline: Driveline, found: tuple[Stretch, ...]
    ) -> None:
        self.signals = signals
        self.windows = join([s.windows for s in found])
        counts = [s.windows.count for s in found]
        self.ratio = np.repeat([s.ratio for s in found], counts)
        self.stretch = tuple(np.repeat([s.name for s in found], counts).tolist())
        tied = np.repeat([s.tied for s in found], counts)
        self.constant = Quadrature(csr_array(0.5 * self.windows.width[:, None]))
        self.torque = hann_kernels(signals.output_torque.time, self.windows).psi
        self.engine = hann_kernels(signals.engine_speed.time, self.windows).slope
        self.output = hann_kernels(signals.output_speed.time, self.windows).slope
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
        kernels = kernels or hann_kernels(torque.time, self.windows, theta[3])
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

    def rounding(self, theta: FloatArray) -> Term:
        """The part of the engine torque's mean rounding error, -η·θ[4]."""
        area, factor = self.constant, np.full_like(self.ratio, -theta[0] * theta[ROUNDING])
        slopes = {
            0: (np.full_like(self.ratio, -theta[ROUNDING]), area),
            ROUNDING: (np.full_like(self.ratio, -theta[0]), area),
        }
        return Term(np.ones(1), 0.0, area, factor, slopes)

    def terms(self, theta: FloatArray) -> list[Term]:
        """All parts of the equations at θ, the engine torque first."""
        return [self.engine_torque(theta), *self.others(theta), self.rounding(theta)]


def rounding_error(torque: Sampled, step: float) -> float:
    """Standard deviation [N m] of the mean error that rounding to `step` leaves.

    Noise of standard deviation σ dithers the rounding; what stays of its mean error is periodic
    in the level with amplitude (step/π)·exp(-2π²σ²/step²) (Widrow and Kollár 2008). `torque.sigma`
    holds noise and rounding together. 0 where it is lost in the noise.
    """
    if step == 0.0:
        return 0.0
    square = max(torque.sigma**2 - step**2 / 12.0, 0.0)
    left = float(step / np.pi * np.exp(-2.0 * np.pi**2 * square / step**2) / np.sqrt(2.0))
    return left if left > NO_ROUNDING * torque.sigma else 0.0


def _priors(
    signals: ShiftSignals, driveline: Driveline, settings: MomentumSettings
) -> dict[str, PriorValue]:
    """What is known of the parameters beforehand, by name."""
    rounding = rounding_error(signals.engine_torque, signals.torque_resolution)
    found = {"te_delay": settings.delay_prior, "te_rounding": PriorValue(0.0, rounding)}
    if driveline.J_out is not None:
        found["J_out"] = driveline.J_out
    return found | {f"drum.{one.name}": one.drum for one in driveline.drums}


def known(prior: PriorValue) -> float:
    """Standard deviation of a prior; a known value gets one too small to matter."""
    return prior.std if prior.std > 0.0 else 1e-6 * max(abs(prior.value), 1e-6)


def _scan(
    equations: _Equations, theta: FloatArray, prior: Prior, delays: tuple[float, ...]
) -> DelayScan:
    """Q over the age of the engine torque, the other parameters fitted at each age.

    The weighting is that at `theta`; the equations are then linear in the rest.
    """
    terms = equations.terms(theta)
    whiten = whitening(terms)
    free = [p for p in range(theta.size) if p not in (0, 3)]
    fixed = terms[1].factor * (terms[1].quadrature.matrix @ terms[1].values)
    rest = whiten(np.column_stack([fixed, regressors(terms[1:], theta.size)[:, free]]))
    torque = equations.signals.engine_torque
    drives = [
        hann_kernels(torque.time, equations.windows, delay).psi.matrix @ torque.values
        for delay in delays
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
    ages, values = np.asarray(delays), np.asarray(q)
    return DelayScan(ages, values, parabola_minimum(ages, values))


def parabola_minimum(x: FloatArray, y: FloatArray) -> float:
    """Abscissa of the minimum of y (n,) over equidistant x (n,), by a parabola through three."""
    k = int(np.argmin(y))
    if k in (0, x.size - 1):
        return float(x[k])
    left, middle, right = y[k - 1 : k + 2]
    bend = left - 2.0 * middle + right
    return float(x[k] + 0.5 * (x[k + 1] - x[k]) * (left - right) / bend)


def momentum_inertia(
    signals: ShiftSignals,
    driveline: Driveline,
    settings: MomentumSettings,
    start_inertia: float,
) -> MomentumFit:
    """Estimate η, Je, Jo′, age of T_e and drums over the whole shift, with their covariance.

    `start_inertia` [kg m^2] is any value within the plausible range of J′.
    """
    found = stretches(signals, driveline, settings)
    equations = _Equations(signals, driveline, found)
    names = momentum_names(driveline)
    priors = _priors(signals, driveline, settings)
    entries = {names.index(name): (one.value, known(one)) for name, one in priors.items()}
    prior = Prior.independent(len(names), entries)
    start = prior.mean.copy()
    start[:2] = 0.9, start_inertia
    first = solve(equations.terms, start, prior.held(3, start[3]), tolerance=0.1)
    scan = _scan(equations, first.theta, prior, settings.delay_grid)
    theta = first.theta.copy()
    theta[3] = scan.best
    fit = solve(equations.terms, theta, prior)
    if not scan.tells(fit.std[3]):
        fit = solve(equations.terms, first.theta, prior.held(3, start[3]))
        scan = replace(scan, best=None)
    return _with_evidence(equations, names, priors, fit, scan)


def _with_evidence(
    equations: _Equations,
    names: tuple[str, ...],
    priors: Mapping[str, PriorValue],
    fit: Fit,
    scan: DelayScan,
) -> MomentumFit:
    area = 0.5 * equations.windows.width
    drive, load, engine, output, _ = (
        t.factor * (t.quadrature.matrix @ t.values) / area for t in equations.terms(fit.theta)
    )
    speed = equations.signals.engine_speed
    return MomentumFit(
        names,
        priors,
        fit,
        scan,
        equations.windows.centre,
        equations.stretch,
        drive + load,
        (equations.engine.matrix @ speed.values) / area,
        -(engine + output),
    )
