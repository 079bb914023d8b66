# SPDX-License-Identifier: MIT
"""Conclusions of the likelihood method: estimates, verdicts, curves and warnings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetwin.identify.conclude import Conclusions, labels_of, low_gear_notes
from drivetwin.identify.design import contradictions, design_of, held_against
from drivetwin.identify.likelihood.curves import METHOD, curves_of
from drivetwin.identify.likelihood.derived import absolute_ids, of_log, parameters, slopes
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.hills import loads_of
from drivetwin.identify.likelihood.left_out import left_out
from drivetwin.identify.likelihood.null_space import at_limits, null_directions
from drivetwin.identify.likelihood.other_law import other_law_in_words
from drivetwin.identify.likelihood.priors import over_eta
from drivetwin.identify.likelihood.residuals import against, residual_tests, unweighted
from drivetwin.identify.likelihood.tolerance import sensor_shifts
from drivetwin.identify.likelihood.unknowns import AERO
from drivetwin.identify.load import different_loads
from drivetwin.identify.result import Estimate, FrictionCurve, LoadLaw, Verdict
from drivetwin.identify.signals import Driveline, FloatArray, ShiftSignals
from drivetwin.identify.uncertainty import (
    KNOWN,
    correlation,
    designed,
    doubted,
    judge,
    judge_with_design,
    refused,
)
from drivetwin.parameters import OVER_ETA, spec_of
from drivetwin.vehicle.spec import PriorValue, SensorTolerance

NO_SCALE = (
    "without an output torque sensor all torques share one unknown scale; what is told is the "
    "quantity over η; add an output-shaft torque sensor"
)
AGE = "te_delay"
NO_AGE = "the engine torque moves too little for its age to show"
WITH_ETA = "likelihood over η, times η from design"
"""Method of a torque-like parameter of a log without an output torque, where η is on the card."""
WITH_PRIOR = "likelihood with design prior"
"""Method of a parameter whose own design value took part in its estimate."""


def conclude(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    linear: Mapping[str, FrictionCurve],
    tolerances: Mapping[str, SensorTolerance],
) -> Conclusions:
    """Judge every parameter. `linear` are the friction curves of the linear method, by element."""
    shifts = sensor_shifts(fit, tolerances)
    systematic = sum(
        (np.outer(shift, shift) for shift in shifts.values()), np.zeros_like(fit.covariance)
    )
    values = parameters(fit.problem, fit.mean, signals)
    matrix = slopes(fit.problem, fit.mean, np.sqrt(np.diag(fit.covariance)), signals)
    covariance = matrix @ fit.covariance @ matrix.T
    spread = dict(zip(values, _systematic(matrix, systematic), strict=True)) if shifts else {}
    notes = low_gear_notes(signals)
    designs = {n: known for n in values if (known := _design(n, drivelines)) is not None}
    estimates = {
        name: _estimate(
            (name, value, float(np.sqrt(max(variance, 0.0)))),
            designs.get(name),
            spread.get(name),
            notes.get(name, ""),
        )
        for name, value, variance in zip(values, values.values(), np.diag(covariance), strict=True)
    }
    ids, every = tuple(values), np.array([*values.values()])
    contradicted = contradictions(ids, every, covariance, designs, spread)
    estimates = held_against(estimates, contradicted, WITH_PRIOR)
    limits = {
        name: text
        for name, text in at_limits(fit, ids, matrix).items()
        if estimates[name].verdict is not Verdict.DESIGN
    }
    estimates |= {name: doubted(estimates[name], text) for name, text in limits.items()}
    curves = curves_of(fit, linear, systematic)
    effects = tuple(left_out(fit))
    for effect in effects:
        estimates = effect.held_against(estimates, ids, matrix)
        curves = {name: effect.widened(fit, name, curve) for name, curve in curves.items()}
    for why in (against(fit), unweighted(fit, labels_of(signals))):
        if why:
            estimates = {name: doubted(one, why) for name, one in estimates.items()}
    estimates |= _of_what_is_fixed(fit, signals, drivelines, estimates)
    return Conclusions(
        estimates,
        curves,
        ids,
        correlation(covariance),
        (
            *dict.fromkeys(notes.values()),
            *(one.text for one in contradicted),
            *(f"{name}: {text}" for name, text in limits.items()),
            *_warnings(fit, signals),
            *(one.text for one in effects),
            *other_law_in_words(fit, values, matrix, np.sqrt(np.diag(covariance))),
        ),
        _load_law(fit, systematic),
        loads_of(fit),
    )


def _of_what_is_fixed(
    fit: LikelihoodFit,
    signals: Sequence[ShiftSignals],
    drivelines: Sequence[Driveline],
    estimates: Mapping[str, Estimate],
) -> dict[str, Estimate]:
    """Build the estimates of quantities that the fit holds fixed: absolute values of torque-like
    parameters without an output torque, and the delay of an engine torque that hardly moves."""
    found: dict[str, Estimate] = {}
    if not signals[0].scale_known:
        eta = drivelines[0].known.get("eta")
        for name in absolute_ids(signals):
            ratio = estimates.get(name + OVER_ETA)
            found[name] = _without_scale(name, eta, ratio, _design(name, drivelines))
    for one in (part.structure for part in fit.problem.parts):
        if one.unknown(AGE) not in fit.point.names and AGE not in drivelines[0].known:
            name = of_log(AGE, one.log)
            found[name] = refused(name, METHOD, NO_AGE)
    return found


def _load_law(fit: LikelihoodFit, systematic: FloatArray) -> LoadLaw | None:
    """Build the load law with its growth with speed; None if the fit has a constant load."""
    if AERO not in fit.point.names:
        return None
    k, part = fit.point.names.index(AERO), fit.problem.parts[0]
    std = float(np.sqrt(fit.covariance[k, k] + systematic[k, k]))
    mean_speed = part.structure.mean_speed
    return LoadLaw(fit.mean[AERO], std, mean_speed, over_eta=not part.scale_known)


def _estimate(
    told: tuple[str, float, float], design: PriorValue | None, systematic: float | None, note: str
) -> Estimate:
    """Assess (id, value, standard deviation from noise)."""
    if design is not None:
        return judge_with_design(told, design, WITH_PRIOR, systematic, note)
    name, value, std = told
    return judge(name, value, std, METHOD, systematic, note)


def _without_scale(
    name: str, eta: PriorValue | None, ratio: Estimate | None, design: PriorValue | None
) -> Estimate:
    """Estimate a torque-like parameter of a log without an output torque.

    Identifiable only if η is known from design: the ratio times η, with the spread of η as a
    systematic part.
    """
    if eta is None:
        return Estimate(name, None, None, Verdict.NOT_IDENTIFIABLE, METHOD, reason=NO_SCALE)
    if ratio is None:
        return designed(name, eta.value, eta.std, KNOWN)
    if ratio.value is None or ratio.std_noise is None:
        return replace(ratio, id=name)
    spread = float(np.hypot(eta.value * (ratio.std_systematic or 0.0), eta.std * ratio.value))
    value, noise = eta.value * ratio.value, eta.value * ratio.std_noise
    if ratio.verdict is Verdict.DESIGN:
        return replace(ratio, id=name, value=value, std_noise=noise, std_systematic=spread)
    if design is not None:
        one = judge_with_design((name, value, noise), design, WITH_ETA, spread, ratio.reason)
    else:
        one = judge(name, value, noise, WITH_ETA, spread, ratio.reason)
    return one if ratio.verdict is Verdict.IDENTIFIED else doubted(one, "")


def _design(name: str, drivelines: Sequence[Driveline]) -> PriorValue | None:
    """Return the prior of a reported parameter; None if it has none."""
    spec = spec_of(name)
    ending = OVER_ETA if name.endswith(OVER_ETA) else ""
    known = drivelines[0].known.get(spec.stem + ending if spec.suffix == "log" else name)
    if known is not None:
        return known
    design = design_of(name.removesuffix(OVER_ETA), drivelines[0])
    return over_eta(design, drivelines[0]) if design is not None and ending else design


def _systematic(matrix: FloatArray, systematic: FloatArray) -> list[float]:
    variance = np.einsum("qp,pr,qr->q", matrix, systematic, matrix)
    return [float(np.sqrt(max(v, 0.0))) for v in variance]


def _warnings(fit: LikelihoodFit, signals: Sequence[ShiftSignals]) -> tuple[str, ...]:
    texts = []
    labels = labels_of(signals)
    for s, label, tests in zip(signals, labels, residual_tests(fit).values(), strict=True):
        texts += list(s.shift.warnings)
        texts += [f"{label}: {text}" for test in tests for text in test.warnings]
    if why := unweighted(fit, labels):
        texts.append(why)
    return (*texts, *null_directions(fit), *different_loads(loads_of(fit)))
