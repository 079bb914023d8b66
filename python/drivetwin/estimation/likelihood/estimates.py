# SPDX-License-Identifier: MIT
"""Conclusions of the likelihood method: estimates, verdicts, curves and findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.likelihood.diagnostics.identifiability import (
    find_at_bounds,
    find_null_directions,
)
from drivetwin.estimation.likelihood.diagnostics.misspecification import run_score_tests
from drivetwin.estimation.likelihood.diagnostics.residual_tests import (
    check_residuals,
    check_weighting,
)
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.selection.loss_law import check_other_law
from drivetwin.estimation.likelihood.selection.per_shift_load import collect_loads
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_jacobian,
    compute_parameters,
    list_absolute_ids,
    make_log_id,
)
from drivetwin.estimation.likelihood.uncertainty.friction_bands import METHOD, build_friction_curves
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import compute_sensor_shifts
from drivetwin.estimation.linear.load_balance import AERO, report_different_loads
from drivetwin.estimation.result.assessment import FittedParameters
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, LoadLaw, Verdict
from drivetwin.estimation.result.estimate_set import (
    EstimateSet,
    check_excitation,
    collect_shift_labels,
)
from drivetwin.estimation.result.verdict import (
    apply_errors,
    assess,
    assess_with_prior,
    compute_correlation,
    from_prior,
    refuse_parameter,
    reject_identified,
)
from drivetwin.findings import Code, explain
from drivetwin.parameters import OVER_ETA
from drivetwin.vehicle.spec import PriorValue, SensorTolerance

AGE = "te_delay"
WITH_ETA = "likelihood over η, times η from design"
"""Method of a torque-like parameter of a log without an output torque, where η is on the card."""
WITH_PRIOR = "likelihood with design prior"
"""Method of a parameter whose own design value took part in its estimate."""


def build_estimates(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    linear: Mapping[str, FrictionCurve],
    tolerances: Mapping[str, SensorTolerance],
) -> EstimateSet:
    """Judge every parameter. `linear` are the friction curves of the linear method, by element."""
    shifts = compute_sensor_shifts(fit, tolerances)
    systematic = sum(
        (np.outer(shift, shift) for shift in shifts.values()), np.zeros_like(fit.covariance)
    )
    values = compute_parameters(fit.problem, fit.mean, signals)
    matrix = compute_jacobian(fit.problem, fit.mean, np.sqrt(np.diag(fit.covariance)), signals)
    covariance = matrix @ fit.covariance @ matrix.T
    spread = (
        dict(zip(values, _compute_systematic_std(matrix, systematic), strict=True))
        if shifts
        else {}
    )
    fitted = FittedParameters(
        ids=tuple(values),
        values=np.array([*values.values()]),
        covariance=covariance,
        std=np.sqrt(np.maximum(np.diag(covariance), 0.0)),
        driveline=drivelines[0],
        systematic=spread,
        notes=check_excitation(signals),
        method=METHOD,
        prior_method=WITH_PRIOR,
    )
    ids, estimates = fitted.ids, fitted.downgrade_conflicts(fitted.assess())
    limits = [
        one
        for one in find_at_bounds(fit, ids, matrix)
        if estimates[one.subject].verdict is not Verdict.DESIGN
    ]
    estimates = apply_errors(estimates, limits)
    curves = build_friction_curves(fit, linear, systematic)
    effects = tuple(run_score_tests(fit))
    for effect in effects:
        estimates = effect.held_against(estimates, ids, matrix)
        curves = {name: effect.widened(fit, name, curve) for name, curve in curves.items()}
    labels = collect_shift_labels(signals)
    disagreements = (*check_residuals(fit, labels), *check_weighting(fit, labels))
    estimates = apply_errors(estimates, disagreements)
    estimates |= _estimate_fixed(fit, signals, drivelines, estimates)
    return EstimateSet(
        estimates,
        curves,
        ids,
        compute_correlation(covariance),
        (
            *dict.fromkeys(fitted.notes.values()),
            *(one.finding for one in fitted.conflicts),
            *limits,
            *disagreements,
            *find_null_directions(fit),
            *report_different_loads(collect_loads(fit)),
            *(one.finding for one in effects),
            *check_other_law(fit, values, matrix, np.sqrt(np.diag(covariance))),
        ),
        _build_load_law(fit, systematic),
        collect_loads(fit),
    )


def _estimate_fixed(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    estimates: Mapping[str, Estimate],
) -> dict[str, Estimate]:
    """Build the estimates of quantities that the fit holds fixed: absolute values of torque-like
    parameters without an output torque, and the delay of an engine torque that hardly moves."""
    found: dict[str, Estimate] = {}
    if not signals[0].scale_known:
        eta = drivelines[0].known.get("eta")
        for name in list_absolute_ids(signals):
            ratio = estimates.get(name + OVER_ETA)
            found[name] = _estimate_without_scale(name, eta, ratio, drivelines[0].find_prior(name))
    for one in (part.structure for part in fit.problem.parts):
        if one.get_unknown(AGE) not in fit.point.names and AGE not in drivelines[0].known:
            name = make_log_id(AGE, one.log)
            found[name] = refuse_parameter(name, METHOD, explain(Code.DELAY_NOT_EXCITED))
    return found


def _build_load_law(fit: LikelihoodFit, systematic: FloatArray) -> LoadLaw | None:
    """Build the load law with its growth with speed; None if the fit has a constant load."""
    if AERO not in fit.point.names:
        return None
    k, part = fit.point.names.index(AERO), fit.problem.parts[0]
    std = float(np.sqrt(fit.covariance[k, k] + systematic[k, k]))
    mean_speed = part.structure.mean_speed
    return LoadLaw(fit.mean[AERO], std, mean_speed, over_eta=not part.scale_known)


def _estimate_without_scale(
    name: str, eta: PriorValue | None, ratio: Estimate | None, design: PriorValue | None
) -> Estimate:
    """Estimate a torque-like parameter of a log without an output torque.

    Identifiable only if η is known from design: the ratio times η, with the spread of η as a
    systematic part.
    """
    if eta is None:
        reason = explain(Code.NO_TORQUE_SCALE)
        return Estimate(name, None, None, Verdict.NOT_IDENTIFIABLE, METHOD, reason=reason)
    if ratio is None:
        return from_prior(name, eta)
    if ratio.value is None or ratio.std_noise is None:
        return replace(ratio, id=name)
    spread = float(np.hypot(eta.value * (ratio.std_systematic or 0.0), eta.std * ratio.value))
    value, noise = eta.value * ratio.value, eta.value * ratio.std_noise
    if ratio.verdict is Verdict.DESIGN:
        return replace(ratio, id=name, value=value, std_noise=noise, std_systematic=spread)
    if design is not None:
        one = assess_with_prior((name, value, noise), design, WITH_ETA, spread, ratio.reason)
    else:
        one = assess(name, value, noise, WITH_ETA, spread, ratio.reason)
    return one if ratio.verdict is Verdict.IDENTIFIED else reject_identified(one, "")


def _compute_systematic_std(matrix: FloatArray, systematic: FloatArray) -> list[float]:
    variance = np.einsum("qp,pr,qr->q", matrix, systematic, matrix)
    return [float(np.sqrt(max(v, 0.0))) for v in variance]
