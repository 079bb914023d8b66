# SPDX-License-Identifier: MIT
"""Initial values of the fit: from the linear method if it estimated them, else typical ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.likelihood.parametrization import LAW, build_load_deviations
from drivetwin.estimation.linear.friction_points import LOG_V, MU_C, MU_DROP, MU_V
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.linear.pipeline import IntegralShift
from drivetwin.simulation.dual_clutch import compute_series_inertia

TYPICAL_LAW = {"mu_c": 0.11, "mu_drop": 0.02, "mu_v": 1e-4, "ln_v_s": float(np.log(12.0))}
"""Friction of a wet clutch facing where the log shows none."""
TYPICAL_MODE = (2.0 * np.pi * 10.0, 0.06)
"""Angular frequency [rad/s] and damping ratio of a driveline where no ring-down was clean."""


def _extrapolate_load(shift: IntegralShift, growth: float | None, i_f: float) -> float:
    """Compute T_v/i_f [N m] of a shift under the common growth of the load: it is accurate at
    the shift's own speed, and at the mean speed of the log as inaccurate as the shift's own
    growth."""
    found = shift.load
    if growth is None or found.holds_at is None:
        return found.load
    away = (found.mean_speed**2 - found.holds_at**2) / i_f
    return found.load + (float(found.fit.theta[2]) - growth) * away


def estimate_initial_values(
    shifts: Sequence[IntegralShift], drivelines: Sequence[KnownDriveline]
) -> dict[str, float]:
    """Compute an initial value of every driveline unknown and friction law from the linear fits.

    The median over the shifts is used, because a single shift may be uninformative or wrong.
    """
    told = {
        name: float(np.median([dict(zip(s.ids, s.values, strict=True))[name] for s in having]))
        for name in dict.fromkeys(name for shift in shifts for name in shift.ids)
        for having in ([shift for shift in shifts if name in shift.ids],)
    }
    found = {
        "eta": told["eta"],
        "J_e": float(np.median([shift.momentum.get_value("J_e") for shift in shifts])),
        "J_out": told["J_out"],
        "J_vehicle": told["J_vehicle"],
        **build_load_deviations(
            [_extrapolate_load(shift, told.get(AERO), drivelines[0].i_f) for shift in shifts]
        ),
        "te_delay": told.get("te_delay", shifts[0].momentum.get_value("te_delay")),
    }
    if AERO in told:
        found[AERO] = told[AERO]
    if "k_o" in told:
        found |= {"k_o": told["k_o"], "c_o": told["c_o"]}
    else:
        found |= _estimate_typical_shaft(found, drivelines[0])
    return {k: float(v) for k, v in found.items()} | _collect_laws(shifts, drivelines)


def _estimate_typical_shaft(
    found: Mapping[str, float], driveline: KnownDriveline
) -> dict[str, float]:
    omega, zeta = TYPICAL_MODE
    J4 = found["J_e"] * driveline.i_after**2 + found["J_out"]
    J5 = found["J_vehicle"] / driveline.i_f**2
    J = compute_series_inertia(J4, J5)
    return {"k_o": J * omega**2, "c_o": 2.0 * zeta * omega * J}


def _collect_laws(
    shifts: Sequence[IntegralShift], drivelines: Sequence[KnownDriveline]
) -> dict[str, float]:
    """Compute law, P0 and drum of every element; one without a curve takes its partner's.

    Of several curves the one that reaches the largest slip: beyond its slips a law may be anything,
    even below zero.
    """
    found: dict[str, float] = {}
    own: dict[str, dict[str, float]] = {}
    reached: dict[str, float] = {}
    for shift, d in zip(shifts, drivelines, strict=True):
        for e in (d.offgoing, d.oncoming):
            found.setdefault(f"{e.name}.P0", e.P0.value)
        found |= {f"{e.name}.drum": e.drum.value for e in d.couplings.values()}
        name = d.oncoming.name
        if shift.friction is None or shift.friction.curve.slip[-1] <= reached.get(name, 0.0):
            continue
        reached[name] = float(shift.friction.curve.slip[-1])
        theta = shift.friction.fit.theta
        order = (MU_C, MU_DROP, MU_V, LOG_V)
        own[name] = {key: float(theta[i]) for key, i in zip(LAW, order, strict=True)}
        found[f"{name}.P0"] = shift.friction.P0
    laws = dict(own)
    for d in drivelines:
        for e, partner in ((d.oncoming, d.offgoing), (d.offgoing, d.oncoming)):
            laws.setdefault(e.name, own.get(partner.name, TYPICAL_LAW))
    for name, law in laws.items():
        found |= {f"{name}.{key}": value for key, value in law.items()}
    return found
