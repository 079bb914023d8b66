# SPDX-License-Identifier: MIT
"""The paper's procedure on one shift, stage by stage as published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.linear.ringdown import RingDown, compute_shaft_parameters
from drivetwin.estimation.paper.friction import PaperFriction, estimate_paper_friction
from drivetwin.estimation.paper.inertia import PaperInertiaSettings, estimate_paper_inertia
from drivetwin.estimation.paper.load import PaperLoadSettings, estimate_paper_load
from drivetwin.estimation.paper.ringdown import estimate_paper_ringdown
from drivetwin.estimation.paper.wlse import GridFit, Weighting
from drivetwin.estimation.result.assessment import collect_fill_pressures
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.estimation.result.prior_conflict import check_range
from drivetwin.estimation.result.verdict import (
    from_prior,
    get_experiment,
    join_reasons,
    refuse_parameter,
)
from drivetwin.findings import Code, Finding, explain, report
from drivetwin.parameters import get_parameter_spec

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
    estimates |= collect_fill_pressures(drivelines, Code.PAPER_CARD_VALUE)
    friction = {s.friction.element: s.friction.curve for s in shifts if s.friction is not None}
    doubts = dict.fromkeys(
        one for shift in shifts for found in shift.doubts.values() for one in found
    )
    findings = (report(Code.PAPER_BIASED), *doubts)
    return EstimateSet(estimates, friction, (), np.empty((0, 0)), findings)
