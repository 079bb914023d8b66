# SPDX-License-Identifier: MIT
"""Friction curves of the fit, with bands from its covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.estimation.direct.friction_law import build_law_derivatives, evaluate_stribeck
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.friction import FrictionShapes, has_free_law
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.motion import find_loaded_slips
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import differentiate
from drivetwin.estimation.result.cause import SHOWN, Group
from drivetwin.estimation.result.estimate import Z95, FrictionCurve, Verdict
from drivetwin.findings import Code, explain
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue

METHOD = "likelihood"
POINTS = 60


def find_reference_slips(fit: LikelihoodFit) -> dict[str, float]:
    """Return the slip [rad/s] in the middle of the curve of every element whose law is free."""
    return {name: _build_empty_curve(fit, name).middle_slip for name in _list_free_laws(fit)}


def build_friction_curves(fit: LikelihoodFit, correction: Correction) -> dict[str, FrictionCurve]:
    """Compute the curves of all elements, for the gains of the vehicle card.

    A curve covers the slips at which the element transmits torque in the simulated shifts. The band
    is that of the law and of the shapes beside it, with all effects; the curve contains shapes with
    evidence. An element that only disengages has the law of its partner with a level of its own,
    over the slips of the partner.
    """
    found: dict[str, FrictionCurve] = {}
    for name in _list_free_laws(fit):
        base = _build_empty_curve(fit, name)
        curve = _build_curve(fit, correction, name, base)
        slopes = evaluate_stribeck(_get_law(fit, correction, name)[0], base.slip)[1]
        change, variance = _add_shapes(fit, correction, name, base.slip, slopes)
        found[name] = _set_band(curve, curve.mu + change, np.sqrt(variance))
    for name, partner in fit.problem.terms[0].plant.partners.items():
        if partner in found:
            curve = _build_curve(fit, correction, name, found[partner])
            found[name] = replace(
                curve,
                verdict=Verdict.DESIGN,
                reason=explain(Code.PARTNER_FRICTION, partner=partner),
            )
    return {name: curve.add_gain_spread(_get_gain(fit, name)) for name, curve in found.items()}


def _list_free_laws(fit: LikelihoodFit) -> list[str]:
    """List the elements whose friction law is free."""
    every = (one.name for term in fit.problem.terms for one in term.plant.elements)
    return [name for name in dict.fromkeys(every) if has_free_law(fit.point, name)]


def _get_gain(fit: LikelihoodFit, name: str) -> PriorValue:
    return fit.problem.terms[0].plant.driveline.couplings[name].gain_prior


def _get_law(
    fit: LikelihoodFit, correction: Correction, name: str
) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients `LAW` (4,) of an element and their derivatives (4, p) by the
    unknowns."""
    structure = next(
        term.plant
        for term in fit.problem.terms
        if name in (one.name for one in term.plant.elements)
    )
    std = np.sqrt(np.diag(fit.covariance))

    def compute(at: ParameterVector) -> dict[str, float]:
        return dict(zip(LAW, structure.get_law(at, name), strict=True))

    rows = differentiate(compute, correction.mean, std, fit.problem)
    return np.array(structure.get_law(correction.mean, name)), rows


def _build_curve(
    fit: LikelihoodFit, correction: Correction, name: str, base: FrictionCurve
) -> FrictionCurve:
    """Build the curve of the friction law of an element over the slips of `base`."""
    theta, rows = _get_law(fit, correction, name)
    covariance = rows @ correction.covariance @ rows.T
    mu, slopes = evaluate_stribeck(theta, base.slip)
    mu_c, drop, mu_v, ln_v_s = (float(v) for v in theta)
    to_law = build_law_derivatives(float(np.exp(ln_v_s)))
    curve = replace(
        base,
        stribeck=Stribeck(mu_c, mu_c + drop, float(np.exp(ln_v_s)), mu_v),
        method=METHOD,
        stribeck_covariance=to_law @ covariance @ to_law.T,
        over_eta=not fit.problem.terms[0].compares(OUTPUT_TORQUE),
    )
    return _set_band(curve, mu, np.sqrt(propagate_variance(slopes.T, covariance)))


def _set_band(curve: FrictionCurve, mu: FloatArray, std: FloatArray) -> FrictionCurve:
    """Return the curve with other values (n,) and standard deviations (n,)."""
    return replace(curve, mu=mu, mu_lo=mu - Z95 * std, mu_hi=mu + Z95 * std)


def _add_shapes(
    fit: LikelihoodFit, correction: Correction, name: str, slip: FloatArray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute the change of μ (n,) by the shapes beside the law, and the variance (n,) of both."""
    size, group = fit.point.values.size, Group(EffectId.FRICTION_SHAPE, name)
    index = [fit.point.names.index(f"{name}.{key}") for key in LAW]
    columns = correction.step.columns.find_columns(group)
    if not columns:
        total = correction.covariance[np.ix_(index, index)]
        return np.zeros(slip.size), propagate_variance(slopes.T, total)
    law = fit.point.values[index]
    largest = max(
        float(np.max(find_loaded_slips(term, fit.point, name), initial=1.0))
        for term in fit.problem.terms
    )
    scale = EFFECTS[EffectId.FRICTION_SHAPE].std * correction.step.columns.scale[columns]
    shapes = FrictionShapes(law, largest).evaluate(np.abs(slip)) * scale
    both = [*index, *(size + k for k in columns)]
    rows = np.vstack([slopes, shapes.T])
    total = correction.joint_covariance[np.ix_(both, both)]
    change = shapes @ correction.step.amounts[columns]
    variance = propagate_variance(rows.T, total)
    if correction.evidence[group].nats > SHOWN:
        return change, variance
    return np.zeros(slip.size), variance + change**2


def _build_empty_curve(fit: LikelihoodFit, name: str) -> FrictionCurve:
    """Build an empty curve over the slips at which the element transmits torque in a simulated
    shift."""
    slip = np.concatenate([find_loaded_slips(term, fit.point, name) for term in fit.problem.terms])
    grid = np.linspace(float(slip.min()), float(slip.max()), POINTS)
    nothing, empty = np.zeros(POINTS), np.empty(0)
    return FrictionCurve(grid, nothing, nothing, nothing, empty, empty, None, METHOD)
