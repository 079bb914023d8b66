# SPDX-License-Identifier: MIT
"""The paper's procedure on one shift, stage by stage as published.

1. Gear efficiency η and lumped inertia J′ (eq. 10), the paper's way and in momentum form:
   η·T_e - T_o/i_g = J′·ω_e', with J′ = Je + Jo′/i_g² and Je = J1·η + J2e.
2. Load.
3. Lock-up oscillation.
4. Friction curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from drivetwin._util.arrays import FloatArray, Span, compute_moving_mean
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.load_balance import (
    WINDOW,
    compute_window_edges,
    compute_window_means,
    drop_nan_rows,
)
from drivetwin.estimation.direct.ringdown import (
    RING_DOWN,
    RingDown,
    compute_shaft_parameters,
    refuse_ringdown,
    select_ring_samples,
)
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.estimation.result.prior_conflict import check_range, collect_fill_pressures
from drivetwin.estimation.result.verdict import (
    from_prior,
    get_experiment,
    join_reasons,
    refuse_parameter,
)
from drivetwin.findings import Code, Finding, explain, report
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.parameters import get_parameter_spec
from drivetwin.simulation.dual_clutch import Stribeck


@dataclass(frozen=True)
class GridRow:
    """One row of the paper's Table 1: grid value, inertia [kg m^2], RMS error [N m]."""

    value: float
    inertia: float
    rmse: float


@dataclass(frozen=True)
class Weighting:
    """Plausible inertia range [kg m^2]; samples inside it weigh 1, others `outside`."""

    low: float
    high: float
    outside: float = 0.01


@dataclass(frozen=True, eq=False)
class GridFit:
    """A grid search by weighted least squares.

    `rows` as tabulated, `best` the row of least RMS error. `acceleration` (n,) [rad/s^2] and
    `torque` (n,) [N m] are the scatter at the best grid value, `torque_start` (n,) that at the
    first grid value (the paper's comparison), `weights` (n,) those of the best row.
    """

    rows: tuple[GridRow, ...]
    best: GridRow
    acceleration: FloatArray
    torque: FloatArray
    torque_start: FloatArray
    weights: FloatArray


def compute_central_difference(values: FloatArray, width: float = WINDOW) -> FloatArray:
    """Slope of window means (n,) from the neighbours of each inner window; shape (n-2,)."""
    return (values[2:] - values[:-2]) / (2.0 * width)


def fit_weighted_inertia(
    torque: FloatArray, acceleration: FloatArray, weighting: Weighting, scale: float = 1.0
) -> tuple[float, FloatArray]:
    """Slope J of torque = J·acceleration by weighted least squares, and the weights (n,).

    `scale`·torque/acceleration of a sample is compared with the range of `weighting`.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = scale * torque / acceleration
    plausible = (quotient >= weighting.low) & (quotient <= weighting.high)
    weights = np.where(plausible, 1.0, weighting.outside)
    normal = float(weights @ acceleration**2)
    if normal == 0.0:
        raise IdentificationError(
            "the speed is constant throughout the held gear, so no inertia shows",
            "record a run in which the vehicle accelerates in gear",
        )
    return float(weights @ (acceleration * torque)) / normal, weights


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
    slip = np.abs(_compute_mean_slip(signals, driveline, time))
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


def _compute_mean_slip(
    signals: ShiftSignals, driveline: KnownDriveline, time: FloatArray
) -> FloatArray:
    """Slip of the on-coming element (eq. 15) [rad/s] at `time` (n,), over 11 samples' mean."""

    def smooth(signal: MeasuredSignal) -> FloatArray:
        return np.interp(time, signal.time, compute_moving_mean(signal.values, 11))

    element = driveline.oncoming
    engine, output = smooth(signals.engine_speed), smooth(signals.output_speed)
    return element.a * engine - element.b * output


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
        values, cost = _fit_nonnegative(basis, mu, 2)
        if best is None or cost < best[0]:
            best = (cost, values, float(v_s))
    assert best is not None
    mu_c, mu_s, mu_v = (float(v) for v in best[1])
    return Stribeck(mu_c, mu_s, best[2], mu_v)


def _fit_nonnegative(basis: FloatArray, target: FloatArray, count: int) -> tuple[FloatArray, float]:
    """Fit `basis` (n, p) to `target` (n,) with the first `count` coefficients nonnegative.

    The minimum is that of the least squares without the coefficients that are zero there, so each
    choice of them is tried. Returns the coefficients (p,) and the sum of squares.
    """
    best, least = np.zeros(basis.shape[1]), np.inf
    for zeros in product((False, True), repeat=count):
        free = np.append(~np.array(zeros), np.ones(basis.shape[1] - count, np.bool_))
        values = np.zeros(basis.shape[1])
        values[free] = np.linalg.lstsq(basis[:, free], target, rcond=None)[0]
        cost = float(np.sum((target - basis @ values) ** 2))
        if np.all(values[:count] >= 0.0) and cost < least:
            best, least = values, cost
    return best, least


def estimate_paper_ringdown(torque: MeasuredSignal, lockup: float, end: float) -> RingDown:
    """Frequency from the spacing of the extremes of T_o, damping from their logarithmic decrement.

    T_o is averaged over 10 ms windows; half the difference of neighbouring extremes falls by
    exp(-σ·T/2). Extremes count while they exceed four times the noise of an average.
    """
    part = select_ring_samples(torque, lockup, end, RING_DOWN.latest_start)
    edges = compute_window_edges((part.time[0], part.time[-1]))
    mean, centre = compute_window_means(part, edges), 0.5 * (edges[1:] + edges[:-1])
    count = max(part.time.size / mean.size, 1.0)
    floor = 4.0 * torque.sigma / np.sqrt(count) + 1e-3 * float(np.ptp(mean))
    turn = np.flatnonzero(np.diff(np.sign(np.diff(mean))) != 0) + 1
    picked: list[int] = []
    for k in turn:
        if picked and abs(mean[k] - mean[picked[-1]]) < 2.0 * floor:
            break
        picked.append(int(k))
    if len(picked) < 4:
        raise refuse_ringdown(f"only {len(picked)} extremes stand out of the noise")
    at = np.asarray(picked)
    bend = mean[at - 1] - 2.0 * mean[at] + mean[at + 1]
    shift = 0.5 * (mean[at - 1] - mean[at + 1]) / bend
    instants = centre[at] + shift * (centre[1] - centre[0])
    order = np.arange(at.size)
    half_period = float(np.polyfit(order, instants, 1)[0])
    swing = np.log(0.5 * np.abs(np.diff(mean[at])))
    decrement = -float(np.polyfit(order[:-1], swing, 1)[0])
    rate, omega = decrement / half_period, np.pi / half_period
    if not (rate > 0.0 and RING_DOWN.band[0] < omega / (2 * np.pi) < RING_DOWN.band[1]):
        raise refuse_ringdown(f"decay rate {rate:.3g} 1/s at {omega / (2 * np.pi):.3g} Hz")
    return RingDown(rate, omega, part.time, part.values, instants, mean[at])


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


EXCITATION = 0.03
"""Least relative variation of the engine torque in gear for which eq. 10 separates η and J′."""


@dataclass(frozen=True, eq=False)
class PaperShift:
    """The stages of the paper on one shift; `values` by parameter id, `doubts` by parameter id.

    `inertia` and `load` are the two tables (Table 1, Fig. 6), `inertia_after` the fit of eq. 10 in
    the next gear at the η found, from which J4 comes.
    """

    inertia: GridFit
    inertia_after: GridFit
    load: GridFit
    ring: RingDown | None
    friction: PaperFriction | None
    values: dict[str, float]
    doubts: dict[str, tuple[Finding, ...]]
    refusals: dict[str, str]


def _check_inertia(
    signals: ShiftSignals, fit: GridFit, bounds: tuple[float, float], gear: str
) -> dict[str, tuple[Finding, ...]]:
    """Return findings against η and J′ of the grid search, by parameter id."""
    torque = signals.engine_torque.select_span(signals.shift.before).values
    moving = float(np.std(torque)) / max(abs(float(np.mean(torque))), 1e-9)
    found = [*check_range("J′", fit.best.inertia, bounds), *_check_grid_end("η", fit)]
    if moving < EXCITATION:
        found.append(report(Code.PAPER_POORLY_EXCITED, variation=100.0 * moving, gear=gear))
    return dict.fromkeys(("eta", f"J_prime_{gear}"), tuple(found)) if found else {}


def _check_grid_end(symbol: str, fit: GridFit) -> list[Finding]:
    if fit.best not in (fit.rows[0], fit.rows[-1]):
        return []
    return [report(Code.PAPER_GRID_END, symbol=symbol)]


def identify_paper_shift(
    signals: ShiftSignals,
    driveline: KnownDriveline,
    J_prime_range: tuple[float, float],
    J_vehicle_range: tuple[float, float],
) -> PaperShift:
    """Run the paper's stages. The ranges [kg m^2] set the weights of the two grid searches."""
    shift = signals.shift
    weighting = Weighting(*J_prime_range)
    before = (shift.before[0], shift.before[1] - 3.0 * shift.sigma.get("torque_start", 0.0))
    inertia = estimate_paper_inertia(
        signals, driveline.i_before, before, PaperInertiaSettings(weighting)
    )
    held = PaperInertiaSettings(weighting, (inertia.best.value,))
    after = estimate_paper_inertia(signals, driveline.i_after, shift.after, held)
    load = estimate_paper_load(
        signals, driveline.i_f, before, PaperLoadSettings(Weighting(*J_vehicle_range))
    )
    values = {
        "eta": inertia.best.value,
        f"J_prime_{shift.start_gear}": inertia.best.inertia,
        f"J_prime_{shift.end_gear}": after.best.inertia,
        "Tv_over_if": load.best.value,
        "J_vehicle": load.best.inertia,
    }
    refusals: dict[str, str] = {}
    ring: RingDown | None = None
    friction: PaperFriction | None = None
    try:
        ring = estimate_paper_ringdown(signals.output_torque, shift.lockup_time, shift.after[1])
        values[f"f_d_{shift.end_gear}"] = ring.f_d
        values[f"zeta_{shift.end_gear}"] = ring.zeta
        J4 = after.best.inertia * driveline.i_after**2
        J5 = load.best.inertia / driveline.i_f**2
        k_o, c_o = compute_shaft_parameters(ring.decay_rate, ring.omega_d, J4, J5)
        values |= {"k_o": float(k_o), "c_o": float(c_o)}
    except IdentificationError as error:
        refusals["shaft"] = error.what
    try:
        friction = estimate_paper_friction(signals, driveline)
    except IdentificationError as error:
        refusals["friction"] = error.what
    doubts = _check_inertia(signals, inertia, J_prime_range, shift.start_gear)
    found = (
        *check_range("J3", load.best.inertia, J_vehicle_range),
        *_check_grid_end("T_v/i_f", load),
    )
    if found:
        doubts |= dict.fromkeys(("Tv_over_if", "J_vehicle"), found)
    if outside := check_range("J′", after.best.inertia, J_prime_range):
        doubts[f"J_prime_{shift.end_gear}"] = tuple(outside)
    rests = (report(Code.PAPER_DOUBTFUL_INERTIA),)
    doubts |= {k: rests for k in ("k_o", "c_o") if doubts and k in values}
    return PaperShift(inertia, after, load, ring, friction, values, doubts, refusals)


METHOD = "paper"


def assess_paper_shifts(
    shifts: Sequence[PaperShift],
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
) -> EstimateSet:
    """Take each value, with its doubts, from the first shift that determines it.

    The paper's method gives no interval, so no value counts as identified. Jo′ and P0 are those of
    the card, as the paper assumes them known.
    """
    estimates: dict[str, Estimate] = {}
    for shift in shifts:
        for name, value in shift.values.items():
            if name in estimates and estimates[name].value is not None:
                continue
            doubt = join_reasons(*(one.cause for one in shift.doubts.get(name, ())))
            if not get_parameter_spec(name).lower <= value <= get_parameter_spec(name).upper:
                estimates[name] = refuse_parameter(name, METHOD, doubt)
                continue
            reason = explain(Code.PAPER_NO_INTERVAL)
            if doubt:
                reason = join_reasons(doubt, get_experiment(name))
            estimates[name] = Estimate(name, value, None, Verdict.WEAK, METHOD, reason=reason)
    for shift, s in zip(shifts, signals, strict=True):
        gear = s.shift.end_gear
        for name in ("k_o", "c_o", f"f_d_{gear}", f"zeta_{gear}"):
            if name not in shift.values and name not in estimates:
                estimates[name] = refuse_parameter(name, METHOD, shift.refusals["shaft"])
    for driveline in drivelines:
        if driveline.J_out is not None:
            estimates["J_out"] = from_prior("J_out", driveline.J_out, Code.PAPER_CARD_VALUE)
    estimates |= collect_fill_pressures(drivelines)
    friction = {s.friction.element: s.friction.curve for s in shifts if s.friction is not None}
    doubts = dict.fromkeys(
        one for shift in shifts for found in shift.doubts.values() for one in found
    )
    findings = (report(Code.PAPER_BIASED), *doubts)
    return EstimateSet(estimates, friction, (), np.empty((0, 0)), findings)
