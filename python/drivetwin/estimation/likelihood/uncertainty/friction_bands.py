# SPDX-License-Identifier: MIT
"""Friction curves of the fit, with bands from its covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.likelihood.slip_contact import find_loaded_slips
from drivetwin.estimation.linear.friction_points import evaluate_stribeck
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.simulation.dual_clutch import Stribeck

METHOD = "likelihood"
POINTS = 60


def build_friction_curves(
    fit: LikelihoodFit, linear: Mapping[str, FrictionCurve], systematic: FloatArray
) -> dict[str, FrictionCurve]:
    """Compute the curve of every element whose friction law is free.

    `linear` are the curves of the linear method: their points and slip range are shown. Its
    place is taken by the slips of the simulation where there is none. `systematic` (p, p) is the
    covariance from the sensors' tolerances; it widens the band.
    """
    found: dict[str, FrictionCurve] = {}
    parts = fit.problem.parts
    for name in dict.fromkeys(one.name for part in parts for one in part.structure.elements):
        if f"{name}.{LAW[-1]}" not in fit.point.names:
            continue
        base = linear.get(name) or _build_empty_curve(fit, name)
        index = [fit.point.names.index(f"{name}.{key}") for key in LAW]
        theta, square = fit.mean.values[index], np.ix_(index, index)
        mu, slopes = evaluate_stribeck(theta, base.slip)
        total = (fit.covariance + systematic)[square]
        half = Z95 * np.sqrt(np.einsum("pn,pq,qn->n", slopes, total, slopes))
        mu_c, drop, mu_v, ln_v_s = (float(v) for v in theta)
        v_s = float(np.exp(ln_v_s))
        to_law = np.array([[1.0, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0, v_s], [0, 0, 1, 0]])
        found[name] = replace(
            base,
            mu=mu,
            mu_lo=mu - half,
            mu_hi=mu + half,
            stribeck=Stribeck(mu_c, mu_c + drop, v_s, mu_v),
            method=METHOD,
            stribeck_covariance=to_law @ fit.covariance[square] @ to_law.T,
            over_eta=not parts[0].scale_known,
        )
    return found


def _build_empty_curve(fit: LikelihoodFit, name: str) -> FrictionCurve:
    """Build an empty curve over the slips at which the element transmits torque in a simulated
    shift."""
    slip = np.concatenate([find_loaded_slips(part, fit.point, name) for part in fit.problem.parts])
    grid = np.linspace(float(slip.min()), float(slip.max()), POINTS)
    nothing, empty = np.zeros(POINTS), np.empty(0)
    return FrictionCurve(grid, nothing, nothing, nothing, empty, empty, None, METHOD)
