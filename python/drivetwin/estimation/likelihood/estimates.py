# SPDX-License-Identifier: MIT
"""Conclusions of the likelihood method: estimates, verdicts, curves and findings.

Spread of a simulation driven by measured inputs, as predicted from all known uncertainties.

A right model misses the measurement by sensor noise, by the noise of its inputs sent through the
driveline, and by the errors of its parameters and effects. The variance of each compared sample is
the sum of the three.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.load_balance import AERO, report_different_loads
from drivetwin.estimation.likelihood.effects.causes import (
    compute_doubt,
    describe_cause,
    find_cause,
    find_unreliable,
    get_advice,
    report_cause,
    widen_by_rivals,
)
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.correction import (
    CORRECTION,
    Correction,
    correct_fit,
    keep_fit,
)
from drivetwin.estimation.likelihood.fit import (
    LikelihoodFit,
    find_at_bounds,
    find_null_directions,
    is_at_bound,
)
from drivetwin.estimation.likelihood.motion import simulate_motion
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm, read_map_changes
from drivetwin.estimation.likelihood.selection.candidates import check_other_law, collect_loads
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_laws,
    compute_parameters,
    differentiate,
    list_absolute_ids,
    make_log_id,
    rank_card_numbers,
)
from drivetwin.estimation.likelihood.uncertainty.friction_bands import (
    METHOD,
    build_friction_curves,
    find_reference_slips,
)
from drivetwin.estimation.likelihood.uncertainty.torque_scale import (
    OverEta,
    TorqueScale,
    estimate_absolute,
    find_scale,
    scale_covariance,
)
from drivetwin.estimation.result.cause import EXPLAINED, WRONG_ENTRY, Cause, PredictedSpread
from drivetwin.estimation.result.estimate import Estimate, LoadLaw, Verdict
from drivetwin.estimation.result.estimate_set import (
    EstimateSet,
    JointCovariance,
    check_excitation,
    collect_shift_labels,
)
from drivetwin.estimation.result.prior_conflict import PRIOR, FittedParameters, report_refined
from drivetwin.estimation.result.verdict import (
    add_systematic,
    adopt_verdicts,
    apply_errors,
    assess_friction,
    compute_correlation,
    refuse_parameter,
    report_gains,
)
from drivetwin.findings import Code, Finding, explain, report
from drivetwin.likelihood.point import ParameterVector, find_acting, join_columns
from drivetwin.likelihood.residual_covariance import NoisePath
from drivetwin.likelihood.residual_tests import check_residuals, check_weighting, find_order


def predict_spread(
    fit: LikelihoodFit, corrected: Correction
) -> tuple[dict[str, PredictedSpread], ...]:
    """Predict the distribution of measured less simulated signals, for each shift by signal.

    The simulation is that of the chosen plant with the corrected unknowns and none of the other
    effects; it is compared at the stamps of the samples, also where these are means over their
    period. A shift that cannot be simulated with them has no prediction.
    """
    found: list[dict[str, PredictedSpread]] = []
    joint = corrected.joint_covariance
    for term, slopes, z, residual in zip(
        fit.problem.terms,
        fit.normal.slopes,
        corrected.step.columns.matrices
        or [np.zeros((p.record.size, 0)) for p in fit.problem.terms],
        corrected.residuals,
        strict=True,
    ):
        run = simulate_motion(term, corrected.mean)
        if run is None:
            found.append({})
            continue
        simulated = term.record.sample_stamps(run)
        mean = term.record.measured - term.returned - residual - simulated
        rows = join_columns(slopes, z)
        acting = find_acting(rows)
        spread = propagate_variance(rows[:, acting], joint[np.ix_(acting, acting)])
        variance = term.record.sigma**2 + spread
        if term.weighting.path is not None:
            variance += _propagate_inputs(term.weighting.path)
        found.append(_split(term, mean, np.sqrt(variance)))
    return tuple(found)


def _propagate_inputs(path: NoisePath) -> FloatArray:
    """Compute the variance (n,) of the compared samples by the noise of the inputs."""
    response = path.response
    push = sum(
        path.power[name][:, None, None] * drive[:, :, None] * drive[:, None, :]
        for name, drive in response.drive.items()
    )
    state = np.zeros((len(path.inverse), response.states, response.states))
    for k, (step, change) in enumerate(zip(response.transition, np.asarray(push), strict=True)):
        state[k + 1] = step @ state[k] @ step.T + change
    rows = path.seen.data.reshape(-1, response.states)
    centre = path.seen.indices[:: response.states] // response.states
    return np.asarray(np.einsum("ni,nij,nj->n", rows, state[centre], rows))


def _split(term: DualClutchTerm, mean: FloatArray, std: FloatArray) -> dict[str, PredictedSpread]:
    """Split stacked means and standard deviations (n,) by signal."""
    found, first = {}, 0
    for out in term.record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        name = "input_speed" if out.name == "engine_speed" else out.name
        found[name] = PredictedSpread(term.record.time[out.place], mean[rows], std[rows])
    return found


DELAY = "te_delay"
WITH_PRIOR = "likelihood with design prior"
"""Method of a parameter whose own design value took part in its estimate."""


def build_estimates(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    priors: EffectPriors,
) -> EstimateSet:
    """Judge every parameter.

    `priors` are the card's statements on effects and sensors. Values and intervals allow for all
    effects that the model leaves out; where these are too large for that, no value is identified.
    """
    correction = correct_fit(fit, priors)
    corrected = correction or keep_fit(fit)
    cause = find_cause(corrected, fit)
    predicted = corrected
    corrected = widen_by_rivals(corrected, fit, cause)
    slips = find_reference_slips(fit)
    own = _fit_parameters(fit, corrected, signals, drivelines, slips)
    accused = None
    if correction is not None:
        accused = _blame_card(fit, signals, drivelines, priors, corrected, slips)
    if accused is not None:
        corrected, own = accused
        predicted, cause = corrected, find_cause(corrected, fit)
    fitted, values, matrix, std = own.fitted, own.values, own.jacobian, own.std
    curves = build_friction_curves(fit, corrected)
    ids = fitted.ids
    doubts, withdrawn = _judge_residuals(fit, signals, corrected, cause, own)
    subjects = {one.subject for one in withdrawn}
    accuses = "" not in subjects and not is_at_bound(fit, corrected.mean.values)
    conflicts = fitted.list_conflicts(subjects) if accuses else ()
    estimates = fitted.downgrade_conflicts(assess_friction(fitted.assess(), curves), conflicts)
    limits = [
        one
        for one in find_at_bounds(fit, ids, matrix)
        if estimates[one.subject].verdict is not Verdict.DESIGN
    ]
    omitted = () if correction is not None else (report(Code.EFFECTS_OMITTED),)
    disagreements = (*doubts, *omitted, *withdrawn)
    doubt = dict(zip(ids, compute_doubt(corrected, matrix).tolist(), strict=True))
    for name in ids if "" in subjects else subjects:
        estimates[name] = add_systematic(estimates[name], doubt[name])
    estimates = apply_errors(estimates, (*limits, *disagreements))
    scale: TorqueScale | None = None
    contradicted: list[Finding] = []
    if not signals[0].scale_known:
        over_eta = OverEta(values, fitted.covariance, own.covariance, estimates)
        scale, contradicted = find_scale(over_eta, drivelines[0].known)
        absolute = list_absolute_ids(signals)
        estimates |= estimate_absolute(absolute, over_eta, scale, drivelines[0])
    estimates |= _estimate_delays(fit, drivelines)
    loads = tuple((1.0 if scale is None else scale.eta) * one for one in collect_loads(fit))
    curves = adopt_verdicts(curves, estimates)
    return EstimateSet(
        estimates,
        curves,
        ids,
        compute_correlation(own.covariance),
        (
            *dict.fromkeys(fitted.notes.values()),
            *(one.finding for one in conflicts),
            *limits,
            *(() if cause is None else (report_cause(cause, corrected, values, matrix, std),)),
            *(one for one in disagreements if one.subject not in estimates),
            *contradicted,
            *find_null_directions(fit),
            *report_different_loads(loads),
            *report_refined(fitted.priors, estimates),
            *(report_gains(curves, estimates) if accuses else ()),
            *(_check_levels(fit, corrected) if accuses else ()),
            *_check_other_law(fit, signals, dict(zip(ids, matrix, strict=True))),
        ),
        _build_load_law(fit, corrected),
        loads,
        predict_spread(fit, predicted),
        cause,
        own.joint if scale is None else scale_covariance(own.joint, own.every, scale),
        rank_card_numbers(corrected, ids, matrix),
        read_map_changes(corrected.mean),
    )


def _judge_residuals(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    corrected: Correction,
    cause: Cause | None,
    own: _ReportedParameters,
) -> tuple[list[Finding], list[Finding]]:
    """Find what distinguishes the residual from noise, and the values that are not reliable."""
    labels = collect_shift_labels(signals)
    likeliest = () if cause is None else (describe_cause(cause), get_advice(cause))
    found = check_residuals(fit, labels, corrected.residuals, *likeliest)
    withdrawn = find_unreliable(
        corrected, own.fitted.ids, own.jacobian, own.std, is_noise=not found
    )
    chi2 = corrected.step.chi2
    if chi2 > EXPLAINED and not withdrawn:
        found.append(report(Code.RESIDUAL_ABOVE_NOISE, chi2=chi2))
    found += [*find_order(fit.problem, corrected.residuals), *check_weighting(fit, labels)]
    return found, withdrawn


def _check_other_law(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], slopes: Mapping[str, FloatArray]
) -> list[Finding]:
    """Compare the loss laws by their fits without effects: an effect may stand in for a wrong law.

    `slopes` are the derivatives (p,) of the parameters by the unknowns, by id.
    """
    values = compute_parameters(fit.problem, fit.point, signals)
    matrix = np.array([slopes[name] for name in values])
    return check_other_law(fit, values, matrix, _compute_std(matrix, fit.covariance))


@dataclass(frozen=True, eq=False)
class _ReportedParameters:
    """Reported parameters of a correction: `values` by id, their `jacobian` (k, p) by the
    unknowns, total `covariance` (k, k) and `std` (k,). `joint` is the total covariance with the
    friction laws, `every` the values of both by id."""

    fitted: FittedParameters
    values: Mapping[str, float]
    every: Mapping[str, float]
    jacobian: FloatArray
    covariance: FloatArray
    std: FloatArray
    joint: JointCovariance


def _fit_parameters(
    fit: LikelihoodFit,
    corrected: Correction,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    slips: Mapping[str, float],
) -> _ReportedParameters:
    """Compute the reported parameters with their noise and total covariance."""

    def compute(at: ParameterVector) -> dict[str, float]:
        laws = compute_laws(fit.problem, at)
        return {**compute_parameters(fit.problem, at, signals, slips), **laws}

    every = compute(corrected.mean)
    std = np.sqrt(np.diag(fit.covariance))
    both = differentiate(compute, corrected.mean, std, fit.problem)
    joint = JointCovariance(tuple(every), both @ corrected.covariance @ both.T)
    values = compute_parameters(fit.problem, corrected.mean, signals, slips)
    matrix, covariance = both[: len(values)], joint.covariance[: len(values), : len(values)]
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    noise = np.minimum(_compute_std(matrix, corrected.noise), std)
    fitted = FittedParameters(
        ids=tuple(values),
        values=np.array([*values.values()]),
        covariance=matrix @ corrected.inverse @ matrix.T,
        std=noise,
        driveline=drivelines[0],
        systematic=dict(zip(values, np.sqrt(std**2 - noise**2).tolist(), strict=True)),
        notes=check_excitation(signals),
        method=METHOD,
        prior_method=WITH_PRIOR,
        total=covariance,
    )
    return _ReportedParameters(fitted, values, every, matrix, covariance, std, joint)


def _check_levels(fit: LikelihoodFit, corrected: Correction) -> list[Finding]:
    """Report an element whose friction level contradicts that of its partner: one of the gains is
    likely wrong."""
    found = []
    for name, partner in fit.problem.terms[0].plant.partners.items():
        unknown, prior = f"{name}.level", fit.problem.prior
        if unknown not in fit.point.names:
            continue
        k = fit.point.names.index(unknown)
        std = float(prior.precision[k, k]) ** -0.5
        ratio = corrected.mean[unknown]
        if abs(ratio - prior.mean[k]) > PRIOR.contradiction * std:
            found.append(report(Code.GAINS_CONTRADICT, element=name, partner=partner, ratio=ratio))
    return found


def _blame_card(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[KnownDriveline],
    priors: EffectPriors,
    corrected: Correction,
    slips: Mapping[str, float],
) -> tuple[Correction, _ReportedParameters] | None:
    """Correct the fit for the tolerances of sensors alone, if a wrong design value then explains
    the log better than the effects of `corrected`.

    A single step shows that it does not in nearly all logs. `slips` [rad/s] are those at which μ is
    reported, by element.
    """
    found = None
    for more_steps in (0, CORRECTION.more_steps):
        plain = correct_fit(fit, priors.drop_effects(), more_steps)
        if plain is None or plain.step.chi2 > EXPLAINED or is_at_bound(fit, plain.mean.values):
            return None
        own = _fit_parameters(fit, plain, signals, drivelines, slips)
        if not _is_card_likelier(own.fitted, corrected):
            return None
        found = plain, own
    return found


def _is_card_likelier(fitted: FittedParameters, correction: Correction) -> bool:
    """Return whether a wrong design value explains the log better than any effect.

    A value that is `apart` so many standard deviations has the log evidence ½·apart² against it.
    `fitted` are the parameters with the tolerances of sensors and without effects.
    """
    against = max((0.5 * one.apart**2 for one in fitted.conflicts), default=0.0)
    effects = max((one.nats for one in correction.evidence.values()), default=0.0)
    return against > effects + WRONG_ENTRY


def _estimate_delays(
    fit: LikelihoodFit, drivelines: Sequence[KnownDriveline]
) -> dict[str, Estimate]:
    """Build the estimates of delays that the fit holds fixed: those of an engine torque that hardly
    moves."""
    found: dict[str, Estimate] = {}
    for one in (term.plant for term in fit.problem.terms):
        if one.get_unknown(DELAY) not in fit.point.names and DELAY not in drivelines[0].known:
            name = make_log_id(DELAY, one.log)
            found[name] = refuse_parameter(name, METHOD, explain(Code.DELAY_NOT_EXCITED))
    return found


def _build_load_law(fit: LikelihoodFit, corrected: Correction) -> LoadLaw | None:
    """Build the load law with its growth with speed; None if the fit has a constant load."""
    if AERO not in fit.point.names:
        return None
    k, term = fit.point.names.index(AERO), fit.problem.terms[0]
    std = float(np.sqrt(corrected.covariance[k, k]))
    mean_speed = term.plant.mean_speed
    return LoadLaw(corrected.mean[AERO], std, mean_speed, over_eta=not term.compares(OUTPUT_TORQUE))


def _compute_std(matrix: FloatArray, covariance: FloatArray) -> FloatArray:
    """Compute the standard deviations (q,) of parameters from the covariance of the unknowns."""
    variance = propagate_variance(matrix, covariance)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))
