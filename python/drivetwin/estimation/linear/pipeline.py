# SPDX-License-Identifier: MIT
"""The integral method on one shift: all stages in momentum form, and what follows from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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
    select_load_spans,
)
from drivetwin.estimation.linear.momentum_balance import MomentumFit, estimate_momentum_inertia
from drivetwin.estimation.linear.ringdown import (
    Drive,
    RingDown,
    compute_shaft_parameters,
    fit_ringdown,
)
from drivetwin.estimation.linear.ringdown_settings import RING_DOWN
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
