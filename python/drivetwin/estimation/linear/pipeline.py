# SPDX-License-Identifier: MIT
"""The integral method on the shifts of a log: all stages in momentum form, one value by parameter.

Shifts are combined with the weight of their covariance. On a hilly road each shift has a load of
its own, and T_v/i_f is their mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM, find_off_going_release
from drivetwin.estimation.data.shift_data import KnownDriveline, MeasuredSignal, ShiftSignals
from drivetwin.estimation.linear.friction_points import FRICTION, FrictionFit, fit_momentum_friction
from drivetwin.estimation.linear.load_balance import (
    AERO,
    LOAD_BALANCE,
    LoadFit,
    estimate_momentum_load,
    is_common_load,
    select_load_spans,
)
from drivetwin.estimation.linear.momentum_balance import MomentumFit, estimate_momentum_inertia
from drivetwin.estimation.linear.ringdown import (
    RING_DOWN,
    Drive,
    RingDown,
    compute_shaft_parameters,
    fit_ringdown,
)
from drivetwin.estimation.result.verdict import build_block_covariance, propagate
from drivetwin.vehicle.spec import PriorValue

NUISANCES = ("te_rounding", "drum")
"""Stems of what acts on the parameters, is the same in all shifts of a log and is not reported."""


@dataclass(frozen=True, eq=False)
class IntegralShift:
    """Stages of one shift; a stage without enough data is None, with the reason in `refusals`.

    `ids`, `values` (q,), `covariance` (q, q): the parameters that follow, in SI, and those of the
    `NUISANCES` that are uncertain, AERO where the load grows. `priors` by id: what was known
    beforehand, which is in them.
    """

    momentum: MomentumFit
    load: LoadFit
    ring: RingDown | None
    friction: FrictionFit | None
    ids: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    priors: Mapping[str, PriorValue]
    refusals: dict[str, str]


def _compute_gear_inertia(
    driveline: KnownDriveline, momentum: MomentumFit, ratio: float
) -> FloatArray:
    """Row (p,) that gives the inertia at the engine with all couplings locked at `ratio`.

    Drums of open elements included: they swing with the rest.
    """
    row = np.zeros(len(momentum.names))
    row[momentum.find_index("J_e")] = 1.0
    row[momentum.find_index("J_out")] = ratio**-2
    for element in driveline.drums:
        row[momentum.find_index(f"drum.{element.name}")] = (element.a - element.b / ratio) ** 2
    return row


def _fit_ring(
    signals: ShiftSignals, driveline: KnownDriveline, momentum: MomentumFit, load: LoadFit
) -> RingDown:
    """Ring-down fit, with the engine torque's own motion put in."""
    ratio = driveline.i_after
    J4 = float(_compute_gear_inertia(driveline, momentum, ratio) @ momentum.fit.theta) * ratio**2
    J5 = load.J_vehicle / driveline.i_f**2
    gain = momentum.get_value("eta") * ratio * J5 / (J4 + J5)
    shift, measured, delay = signals.shift, signals.engine_torque, momentum.get_value("te_delay")
    after = min(RING_DOWN.latest_start, MOMENTUM.compute_guard("lockup", shift))
    acting = MeasuredSignal(measured.time - delay, measured.values, measured.sigma)
    return fit_ringdown(
        signals.output_torque,
        shift.lockup_time,
        shift.after[1],
        Drive(acting, gain),
        after,
    )


def _compute_derived(
    driveline: KnownDriveline,
    momentum: MomentumFit,
    load: LoadFit,
    ring: RingDown | None,
    gear: str,
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Derive the shaft parameters, nuisances and AERO: ids, values and joint covariance.

    Values and covariance also include the common parameters. Raises IdentificationError if the
    inertias on both sides of the shaft are poorly determined.
    """
    size = len(momentum.names)
    unknown = [name for name, one in momentum.priors.items() if one.std > 0.0]
    nuisances = tuple(name for name in unknown if name.split(".")[0] in NUISANCES)
    kept = [momentum.find_index(name) for name in nuisances]
    after = _compute_gear_inertia(driveline, momentum, driveline.i_after) * driveline.i_after**2
    parts = [momentum.fit.theta, load.fit.theta]
    blocks = [momentum.fit.covariance, load.fit.covariance]
    ids: tuple[str, ...] = ()
    if ring is not None:
        parts.append(np.array([ring.decay_rate, ring.omega_d]))
        blocks.append(ring.covariance)
        ids = ("k_o", "c_o", f"f_d_{gear}", f"zeta_{gear}")
    end = size + load.fit.theta.size

    def values(x: FloatArray) -> FloatArray:
        theta, (tv, J3, *aero) = x[:size], x[size:end]
        before, then = (theta[1] + theta[2] / i**2 for i in (driveline.i_before, driveline.i_after))
        common = [theta[0], before, then, theta[2], theta[3], J3, tv]
        if ring is None:
            return np.array([*common, *theta[kept], *aero])
        rate, omega = x[end:]
        shaft = compute_shaft_parameters(rate, omega, float(after @ theta), J3 / driveline.i_f**2)
        zeta = rate / np.hypot(rate, omega)
        return np.array([*common, *shaft, omega / (2.0 * np.pi), zeta, *theta[kept], *aero])

    found, covariance = propagate(values, np.concatenate(parts), build_block_covariance(*blocks))
    grown = () if load.holds_at is None else (AERO,)
    return (*ids, *nuisances, *grown), found, covariance


def identify_shift(
    signals: ShiftSignals,
    driveline: KnownDriveline,
    start_inertia: float,
    load_at: float | None = None,
) -> IntegralShift:
    """Run all stages on one shift.

    `start_inertia` [kg m^2] is any plausible J′. With `load_at` [rad/s] the load may grow with
    speed, and T_v/i_f refers to this speed. Raises IdentificationError if the data do not determine
    inertia or load; without an oscillation, or with a too short inertia phase, only the parameters
    of that stage are missing.
    """
    settings = MOMENTUM
    shift = signals.shift
    momentum = estimate_momentum_inertia(signals, driveline, settings, start_inertia)
    load = estimate_momentum_load(signals, driveline.i_f, select_load_spans(signals), load_at)
    refusals: dict[str, str] = {}
    ring: RingDown | None = None
    friction: FrictionFit | None = None
    try:
        ring = _fit_ring(signals, driveline, momentum, load)
    except IdentificationError as error:
        refusals["shaft"] = error.what
    try:
        free = find_off_going_release(signals, driveline, settings)
        friction = fit_momentum_friction(signals, driveline, momentum, free, FRICTION)
    except IdentificationError as error:
        refusals["friction"] = error.what
    try:
        further, values, covariance = _compute_derived(
            driveline, momentum, load, ring, shift.end_gear
        )
    except IdentificationError as error:
        ring, refusals["shaft"] = None, error.what
        further, values, covariance = _compute_derived(
            driveline, momentum, load, None, shift.end_gear
        )
    gears = (f"J_prime_{shift.start_gear}", f"J_prime_{shift.end_gear}")
    ids: tuple[str, ...] = ("eta", *gears, "J_out", "te_delay", "J_vehicle", "Tv_over_if")
    ids = (*ids, *further)
    if momentum.scan.best is None:
        keep = [k for k, name in enumerate(ids) if name != "te_delay"]
        ids = tuple(ids[k] for k in keep)
        values, covariance = values[keep], covariance[np.ix_(keep, keep)]
        refusals["te_delay"] = "the engine torque moves too little for its delay to show"
    priors = {name: one for name, one in momentum.priors.items() if name in ids}
    if AERO in ids:
        priors[AERO] = PriorValue(0.0, LOAD_BALANCE.aero_std)
    if friction is not None:
        ids = (*ids, f"P0.{friction.element}")
        priors[ids[-1]] = driveline.oncoming.P0
        values = np.append(values, friction.P0)
        covariance = build_block_covariance(covariance, np.array([[friction.P0_std**2]]))
    return IntegralShift(momentum, load, ring, friction, ids, values, covariance, priors, refusals)


LOAD = "Tv_over_if"
"""Id of the load; on a hilly road each shift has its own, with its number appended after `@`."""


@dataclass(frozen=True)
class CombinationSettings:
    """Settings of the combination of the estimates of several shifts."""

    nugget: float = 1e-7
    """Variance by which parameters may leave an equation between them, as a share of their own
    [ratio]; without it their covariance is singular."""
    min_agreement: float = 1e-3
    """Probability of the scatter of the shifts below which an interval is widened to it
    [probability]."""


COMBINATION = CombinationSettings()


SHAFT = ("k_o", "c_o", "f_d_", "zeta_")
"""Prefixes of parameters derived from ring-down and inertias by nonlinear equations. Each shift
linearises them about its own values. The linearisations of two shifts differ to second order (the
square of a relative standard deviation), so combined values may violate the equations by as much.
"""


def merge_shifts(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Generalised least squares over the shifts' estimates: ids, values (q,), covariance (q, q).

    A prior is in the estimate of every shift with its parameter but counts once: its information
    is taken out for all of them but the first. Nuisances that the shifts share are eliminated last.
    """
    ids, values, covariance = _merge_separate_loads(shifts) or _join_shifts(shifts)
    kept = [k for k, name in enumerate(ids) if name.split(".")[0] not in NUISANCES]
    ids, values = tuple(ids[k] for k in kept), values[kept]
    covariance = covariance[np.ix_(kept, kept)]
    priors = {name: prior for shift in shifts for name, prior in shift.priors.items()}
    wider = np.array(
        [
            _widen_data(_estimate_scatter(name, value, shifts), variance, priors.get(name))
            for name, value, variance in zip(ids, values, np.diag(covariance), strict=True)
        ]
    )
    return ids, values, covariance * np.outer(wider, wider)


def _widen_data(scatter: float, variance: float, prior: PriorValue | None) -> float:
    """Factor on a standard deviation if the shifts scatter by a factor, but not the prior in it."""
    if prior is None or not 0.0 < variance < prior.std**2:
        return scatter
    data = (1.0 / variance - prior.std**-2) / scatter**2
    return float((variance * (data + prior.std**-2)) ** -0.5)


def _estimate_scatter(name: str, value: float, shifts: Sequence[IntegralShift]) -> float:
    """Factor by which the shifts lie further about a value than their noise explains; 1 if it does.

    What a shift alone has, and the load, which may be a shift's own, have none.
    """
    deviations = [
        (shift.values[k] - value) / np.sqrt(shift.covariance[k, k])
        for shift in shifts
        if name in shift.ids and name != LOAD
        for k in (shift.ids.index(name),)
    ]
    square, freedom = float(np.sum(np.square(deviations))), len(deviations) - 1
    if freedom < 1 or square < chdtri(freedom, COMBINATION.min_agreement):
        return 1.0
    return float(np.sqrt(square / freedom))


def collect_different_loads(shifts: Sequence[IntegralShift]) -> tuple[float, ...]:
    """Load of each shift at the output shaft [N m] where they differ; else empty."""
    return tuple(shift.load.load for shift in shifts) if _merge_separate_loads(shifts) else ()


def _merge_separate_loads(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray] | None:
    """Combine the shifts with one load each and report the mean load; None if one load suffices."""
    if len(shifts) == 1 or not all(LOAD in shift.ids for shift in shifts):
        return None
    own = [
        replace(shift, ids=tuple(f"{n}@{k}" if n == LOAD else n for n in shift.ids))
        for k, shift in enumerate(shifts)
    ]
    ids, values, covariance = _join_shifts(own)
    first, *others = [ids.index(f"{LOAD}@{k}") for k in range(len(shifts))]
    rows, loads = np.eye(len(ids)), [first, *others]
    if is_common_load(values[loads], covariance[np.ix_(loads, loads)]):
        return None
    rows[first, [first, *others]] = 1.0 / len(shifts)
    kept = [k for k in range(len(ids)) if k not in others]
    rows = rows[kept]
    names = tuple(LOAD if k == first else ids[k] for k in kept)
    return names, rows @ values, rows @ covariance @ rows.T


def _compute_loose_variances(shift: IntegralShift) -> FloatArray:
    """Variances (q,) by which its parameters may leave the equations between them, as shares."""
    bent = [name.startswith(SHAFT) for name in shift.ids]
    relative = np.diag(shift.covariance) / np.square(shift.values)
    return np.where(bent, np.maximum(relative, COMBINATION.nugget), COMBINATION.nugget)


def _join_shifts(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    if len(shifts) == 1:
        return shifts[0].ids, shifts[0].values, shifts[0].covariance
    ids = tuple(dict.fromkeys(name for shift in shifts for name in shift.ids))
    information = np.zeros((len(ids), len(ids)))
    pull = np.zeros(len(ids))
    scale = np.ones(len(ids))
    for shift in shifts:
        place = [ids.index(name) for name in shift.ids]
        scale[place] = np.sqrt(np.diag(shift.covariance))
    for shift in shifts:
        place = [ids.index(name) for name in shift.ids]
        unit = scale[place]
        weight = np.linalg.inv(
            shift.covariance / np.outer(unit, unit) + np.diag(_compute_loose_variances(shift))
        )
        information[np.ix_(place, place)] += weight
        pull[place] += weight @ (shift.values / unit)
    for name, prior in {n: p for shift in shifts for n, p in shift.priors.items()}.items():
        if prior.std > 0.0:
            k, times = ids.index(name), sum(name in shift.priors for shift in shifts)
            surplus = (times - 1) * (scale[k] / prior.std) ** 2
            information[k, k] -= surplus
            pull[k] -= surplus * prior.value / scale[k]
    covariance = np.linalg.inv(information)
    return ids, (covariance @ pull) * scale, covariance * np.outer(scale, scale)
