# SPDX-License-Identifier: MIT
"""Friction curves of the fit, with bands from its covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.expansion import SHOWN
from drivetwin.estimation.likelihood.effects.friction_shape import FrictionShapes, has_free_law
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.likelihood.slip_contact import find_loaded_slips
from drivetwin.estimation.linear.friction_points import build_law_derivatives, evaluate_stribeck
from drivetwin.estimation.result.cause import Group
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.effects import EffectId

METHOD = "likelihood"
POINTS = 60


def build_friction_curves(
    fit: LikelihoodFit, linear: Mapping[str, FrictionCurve], told: Correction
) -> dict[str, FrictionCurve]:
    """Compute the curve of every element whose friction law is free.

    `linear` are the curves of the linear method: their points and slip range are shown. Its
    place is taken by the slips of the simulation where there is none. The band is that of the law
    and of the shapes beside it, with all effects; the curve contains shapes with evidence.
    """
    found: dict[str, FrictionCurve] = {}
    parts = fit.problem.parts
    for name in dict.fromkeys(one.name for part in parts for one in part.structure.elements):
        if not has_free_law(fit.point, name):
            continue
        base = linear.get(name) or _build_empty_curve(fit, name)
        index = [fit.point.names.index(f"{name}.{key}") for key in LAW]
        theta, square = told.mean.values[index], np.ix_(index, index)
        mu, slopes = evaluate_stribeck(theta, base.slip)
        change, variance = _add_shapes(fit, told, name, base.slip, slopes)
        half = Z95 * np.sqrt(variance)
        mu_c, drop, mu_v, ln_v_s = (float(v) for v in theta)
        v_s = float(np.exp(ln_v_s))
        to_law = build_law_derivatives(v_s)
        found[name] = replace(
            base,
            mu=mu + change,
            mu_lo=mu + change - half,
            mu_hi=mu + change + half,
            stribeck=Stribeck(mu_c, mu_c + drop, v_s, mu_v),
            method=METHOD,
            stribeck_covariance=to_law @ told.covariance[square] @ to_law.T,
            over_eta=not parts[0].scale_known,
        )
    return found


def _add_shapes(
    fit: LikelihoodFit, told: Correction, name: str, slip: FloatArray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute the change of μ (n,) by the shapes beside the law, and the variance (n,) of both."""
    size, group = fit.point.values.size, Group(EffectId.FRICTION_SHAPE, name)
    index = [fit.point.names.index(f"{name}.{key}") for key in LAW]
    columns = told.step.columns.find_columns(group)
    if not columns:
        total = told.covariance[np.ix_(index, index)]
        return np.zeros(slip.size), np.einsum("pn,pq,qn->n", slopes, total, slopes)
    law = fit.point.values[index]
    largest = max(
        float(np.max(find_loaded_slips(part, fit.point, name), initial=1.0))
        for part in fit.problem.parts
    )
    scale = EFFECTS[EffectId.FRICTION_SHAPE].std * told.step.columns.scale[columns]
    shapes = FrictionShapes(law, largest).evaluate(np.abs(slip)) * scale
    both = [*index, *(size + k for k in columns)]
    rows = np.vstack([slopes, shapes.T])
    total = told.joint_covariance[np.ix_(both, both)]
    change = shapes @ told.step.amounts[columns]
    variance = np.einsum("pn,pq,qn->n", rows, total, rows)
    if told.evidence[group].nats > SHOWN:
        return change, variance
    return np.zeros(slip.size), variance + change**2


def _build_empty_curve(fit: LikelihoodFit, name: str) -> FrictionCurve:
    """Build an empty curve over the slips at which the element transmits torque in a simulated
    shift."""
    slip = np.concatenate([find_loaded_slips(part, fit.point, name) for part in fit.problem.parts])
    grid = np.linspace(float(slip.min()), float(slip.max()), POINTS)
    nothing, empty = np.zeros(POINTS), np.empty(0)
    return FrictionCurve(grid, nothing, nothing, nothing, empty, empty, None, METHOD)
