# SPDX-License-Identifier: MIT
"""From values and covariances to estimates with a verdict in words, friction included."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.findings import Code, Finding, Number, Severity, explain, report
from drivetwin.parameters import OVER_ETA, ParameterSpec, get_parameter_spec
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class VerdictSettings:
    """Limits of the verdicts; those of widths are in the parameter table."""

    delay_identified: float = 0.005
    """Half width of the 95 % interval up to which a delay is identified [s]."""
    prior_share: float = 0.8
    """Standard deviation over that of the prior from which the prior dominates [ratio]."""
    sensor_share: float = 0.8
    """Share of sensor tolerances and effects in the standard deviation from which they dominate an
    interval [ratio]."""


VERDICT = VerdictSettings()


_HOLD_STILL = "Hold the pedal still for a second after a firm lock-up."
_EXCITE_ENGINE = "Record fast steps of the engine torque in gear."
_EXPERIMENT = {
    "eta": "Step the pedal in the lower gear.",
    "J_prime": "Step the pedal in the lower gear, or record a shift with a longer inertia phase.",
    "J_out": "Add a shift at another torque, or one with a firmer lock-up.",
    "J_vehicle": "Speed up and slow down in gear, or add a coast-down.",
    "Tv_over_if": "Record more time in gear, or add a coast-down.",
    "k_o": _HOLD_STILL,
    "c_o": _HOLD_STILL,
    "f_d": _HOLD_STILL,
    "zeta": _HOLD_STILL,
    "mu_gain": "Record a shift with a longer inertia phase.",
    "ratio": "Record both speeds of the gearbox in the gear for a few seconds.",
    "i_f": "Record the wheel speed.",
    "P0": "Record a shift with a slower pressure ramp, or shifts at two torque levels.",
    "mu": "Record shifts whose inertia phase covers this slip.",
    "drum": "Record a shift with a longer inertia phase.",
    "te_delay": "Step the pedal in gear.",
    "p_delay": "Record a shift with faster pressure ramps.",
    "mode_frequency": _EXCITE_ENGINE,
    "mode_share": _EXCITE_ENGINE,
    "mode_damping": _EXCITE_ENGINE,
    "backlash": "Tip the pedal into overrun and back.",
    "tyre_slip": "Record the speed of a wheel that is not driven.",
    "shaft_progression": "Record shifts at two torque levels.",
    "shaft_reference": "Record shifts at two torque levels.",
}


_ANY_EXPERIMENT = "Record a manoeuvre that it changes more, or narrow its prior."
"""Experiment for a quantity that is not in the parameter table."""


def get_experiment(parameter_id: str, declared: ParameterSpec | None = None) -> str:
    """Return the experiment that would narrow the interval of a parameter.

    Of one `declared` outside of the parameter table it is any that excites it.
    """
    return _ANY_EXPERIMENT if declared else _EXPERIMENT[get_parameter_spec(parameter_id).stem]


def is_limited(std_noise: float, std_systematic: float | None) -> bool:
    """Return True if sensor tolerances and effects that the model leaves out dominate an interval.

    More data of the same kind do not narrow it.
    """
    systematic = std_systematic or 0.0
    return systematic > VERDICT.sensor_share * float(np.hypot(std_noise, systematic))


def get_advice(
    parameter_id: str,
    std_noise: float,
    std_systematic: float | None,
    declared: ParameterSpec | None = None,
) -> str:
    """Return advice on narrowing an interval: an experiment, or the reason why none does."""
    if is_limited(std_noise, std_systematic):
        return explain(Code.SENSOR_LIMITED)
    return get_experiment(parameter_id, declared)


def assess(
    parameter_id: str,
    value: float,
    std_noise: float,
    method: str,
    std_systematic: float | None = None,
    note: str = "",
    spec: ParameterSpec | None = None,
) -> Estimate:
    """Estimate with its verdict from the width of the total 95 % interval.

    Up to `weak_above` of the value: identified; up to the value itself: weak; wider, or a value
    outside the parameter's bounds: not identifiable, and no value is given. Delays are judged by
    absolute width, since zero is a sound value for them. `spec` declares a quantity that is not in
    the parameter table.
    """
    declared, spec = spec, spec or get_parameter_spec(parameter_id)
    half = Z95 * float(np.hypot(std_noise, std_systematic or 0.0))
    if spec.unit == "s":
        width, limit, end = half, VERDICT.delay_identified, 4.0 * VERDICT.delay_identified
    else:
        width, limit, end = half / max(abs(value), 1e-300), spec.weak_above, 1.0
    inside = spec.lower <= value <= spec.upper
    advice = get_advice(parameter_id, std_noise, std_systematic, declared)
    if not np.isfinite(width) or width > end or not inside:
        shown = Number(value, spec.unit, half)
        code = Code.INTERVAL_WIDER_THAN_VALUE if inside else Code.OUTSIDE_LIMITS
        reason = join_reasons(explain(code, value=shown), advice)
        verdict = Verdict.NOT_IDENTIFIABLE
        return Estimate(parameter_id, None, None, verdict, method, reason=reason, spec=declared)
    reason, verdict = note, Verdict.IDENTIFIED
    if width > limit:
        wide = explain(Code.INTERVAL_WIDE, half=Number(half, spec.unit))
        reason, verdict = join_reasons(note, wide, advice), Verdict.WEAK
    return Estimate(
        parameter_id, value, std_noise, verdict, method, std_systematic, reason, declared
    )


def assess_with_prior(
    computed: tuple[str, float, float],
    design: PriorValue,
    method: str,
    std_systematic: float | None = None,
    note: str = "",
    declared: ParameterSpec | None = None,
) -> Estimate:
    """Estimate of (id, value, standard deviation from noise) in which its own design value took
    part, with its verdict.

    The verdict is that of the design value where the log adds little. A value is never withheld
    for its width: without the log there would be the design value, which is known less.
    """
    name, value, std = computed
    spec = declared or get_parameter_spec(name)
    if design.std == 0.0:
        return replace(from_prior(name, PriorValue(value), Code.FIXED_BY_CARD), spec=declared)
    if std >= VERDICT.prior_share * design.std:
        prior = PriorValue(value, std)
        if declared is None:
            return from_prior(name, prior, Code.CARD_DOMINATES, std_systematic)
        one = from_prior(name, prior, Code.PRIOR_DOMINATES, std_systematic)
        return replace(one, method=method, spec=declared)
    one = assess(name, value, std, method, std_systematic, note, declared)
    if one.value is not None or not spec.lower <= value <= spec.upper:
        return one
    half = Z95 * float(np.hypot(std, std_systematic or 0.0))
    code = Code.INTERVAL_WIDE if declared else Code.INTERVAL_WIDE_WITH_PRIOR
    wide = explain(code, half=Number(half, spec.unit))
    reason = join_reasons(note, wide, get_advice(name, std, std_systematic, declared))
    return Estimate(name, value, std, Verdict.WEAK, method, std_systematic, reason, declared)


def from_prior(
    parameter_id: str,
    prior: PriorValue,
    code: Code = Code.FIXED_BY_CARD,
    std_systematic: float | None = None,
) -> Estimate:
    """Return the estimate of a value that the card states and the log adds little to.

    The part that the log adds is as wrong as its sensors: `std_systematic` if their tolerances are
    stated.
    """
    value, std, reason = prior.value, prior.std, explain(code)
    return Estimate(parameter_id, value, std, Verdict.DESIGN, "card", std_systematic, reason)


def refuse_parameter(parameter_id: str, method: str, why: str) -> Estimate:
    """Return a `not identifiable` estimate with the reason and a suitable experiment."""
    reason = join_reasons(why, get_experiment(parameter_id))
    return Estimate(parameter_id, None, None, Verdict.NOT_IDENTIFIABLE, method, reason=reason)


def reject_identified(one: Estimate, why: str) -> Estimate:
    """Downgrade an identified estimate to weak, with the reason `why`.

    Estimates that are not identifiable or from the card are returned unchanged.
    """
    if one.verdict not in (Verdict.IDENTIFIED, Verdict.WEAK):
        return one
    return replace(one, verdict=Verdict.WEAK, reason=join_reasons(why, one.reason))


def add_systematic(one: Estimate, std: float) -> Estimate:
    """Widen the total interval of an estimate by a systematic `std`; unchanged without value."""
    if one.value is None or not np.isfinite(std):
        return one
    return replace(one, std_systematic=float(np.hypot(one.std_systematic or 0.0, std)))


def apply_errors(
    estimates: Mapping[str, Estimate], findings: Iterable[Finding]
) -> dict[str, Estimate]:
    """Downgrade the estimates that an error is about: its subject, or all if that is no parameter.

    Of several errors of one code without a parameter the first is the reason.
    """
    judged, seen = dict(estimates), set[Code]()
    for one in findings:
        if one.severity is not Severity.ERROR:
            continue
        if one.subject in judged:
            judged[one.subject] = reject_identified(judged[one.subject], one.cause)
        elif one.code not in seen:
            seen.add(one.code)
            judged = {name: reject_identified(each, one.cause) for name, each in judged.items()}
    return judged


def join_reasons(*reasons: str) -> str:
    """Join the reasons of a verdict, sentence after sentence."""
    return " ".join(part for part in reasons if part)


def compute_covariance_root(covariance: FloatArray) -> FloatArray:
    """L (p, p) with L·Lᵀ the covariance, formed on its correlation; what has no spread has none."""
    scale = np.sqrt(np.diag(covariance))
    divisor = np.where(scale > 0.0, scale, 1.0)
    power, directions = np.linalg.eigh(covariance / np.outer(divisor, divisor))
    return np.asarray(scale[:, None] * directions * np.sqrt(np.maximum(power, 0.0)))


def compute_correlation(covariance: FloatArray) -> FloatArray:
    """Correlation matrix; a parameter without uncertainty correlates with nothing."""
    std = np.sqrt(np.diag(covariance))
    scale = np.where(std > 0.0, std, np.inf)
    matrix = covariance / np.outer(scale, scale)
    matrix[np.diag_indices_from(matrix)] = 1.0
    return np.asarray(np.clip(matrix, -1.0, 1.0), dtype=float)


USUAL_FRICTION = (0.09, 0.15)
"""Usual μ of a paper lining in oil at a middle slip [-]; engineering estimate."""


def make_gain_id(element: str, *, over_eta: bool = False) -> str:
    """Return the id of μ times gain of an element."""
    return f"mu_gain.{element}" + (OVER_ETA if over_eta else "")


def assess_friction(
    estimates: Mapping[str, Estimate], curves: Mapping[str, FrictionCurve]
) -> dict[str, Estimate]:
    """Return the estimates with μ times gain as the curves have it.

    A curve contains shapes beside the friction law, and its band their variance.
    """
    found = dict(estimates)
    for element, curve in curves.items():
        name = make_gain_id(element, over_eta=curve.over_eta)
        one = found.get(name)
        if curve.gain is None or one is None:
            continue
        value, std = compute_mu_gain(curve)
        noise = min(one.std_noise if one.std_noise is not None else std, std)
        systematic = float(np.sqrt(max(std**2 - noise**2, 0.0)))
        note = explain(Code.MU_GAIN_SLIP, slip=curve.middle_slip)
        found[name] = assess(name, value, noise, one.method, systematic, note)
    return found


def complete_friction(found: EstimateSet, gains: Mapping[str, PriorValue]) -> EstimateSet:
    """Return a set with μ times gain of every curve that has none yet, as an estimate.

    `gains` are those of the vehicle card [m^3] by element. A curve without a band has no interval,
    so that its value is not identified.
    """
    estimates, curves = dict(found.estimates), dict(found.friction)
    for element, plain in found.friction.items():
        name = make_gain_id(element, over_eta=plain.over_eta)
        if plain.gain is not None or name in estimates or element not in gains:
            continue
        curve = plain.add_gain_spread(gains[element])
        value, std = compute_mu_gain(curve)
        note = explain(Code.MU_GAIN_SLIP, slip=curve.middle_slip)
        if np.isfinite(std):
            estimates[name] = assess(name, value, std, curve.method, None, note)
        else:
            reason = join_reasons(explain(Code.PAPER_NO_INTERVAL), note)
            estimates[name] = Estimate(name, value, None, Verdict.WEAK, curve.method, reason=reason)
        curves[element] = curve
    return replace(found, estimates=estimates, friction=curves)


def compute_mu_gain(curve: FrictionCurve) -> tuple[float, float]:
    """Compute μ times gain [m^3] in the middle of a curve, and its standard deviation.

    Raises ValueError for a curve without a gain.
    """
    if curve.gain is None:
        raise ValueError("the curve has no gain")
    exact = curve.drop_gain_spread()
    mu, low, high = (
        float(np.interp(curve.middle_slip, curve.slip, each))
        for each in (exact.mu, exact.mu_lo, exact.mu_hi)
    )
    return curve.gain.value * mu, curve.gain.value * (high - low) / (2.0 * Z95)


def adopt_verdicts(
    curves: Mapping[str, FrictionCurve], estimates: Mapping[str, Estimate]
) -> dict[str, FrictionCurve]:
    """Return the curves with verdict, reason and widening of their μ times gain."""
    found = {}
    for element, curve in curves.items():
        one = estimates.get(make_gain_id(element, over_eta=curve.over_eta))
        found[element] = curve if one is None else _adopt_verdict(curve, one)
    return found


def _adopt_verdict(curve: FrictionCurve, one: Estimate) -> FrictionCurve:
    """Return a curve with the verdict of its μ times gain, and a band at least as wide."""
    if curve.gain is None:
        return curve
    assumed = explain(Code.MU_FOR_ASSUMED_GAIN) if curve.has_assumed_gain else ""
    reason = join_reasons(one.reason, assumed)
    judged, std = replace(curve, verdict=one.verdict, reason=reason), compute_mu_gain(curve)[1]
    if one.std_total is None or one.std_total <= std:
        return judged
    more = Z95 * float(np.sqrt(one.std_total**2 - std**2)) / curve.gain.value
    below, above = (np.hypot(end - curve.mu, more) for end in (curve.mu_lo, curve.mu_hi))
    return replace(judged, mu_lo=curve.mu - below, mu_hi=curve.mu + above)


def report_assumed_gains(curves: Mapping[str, FrictionCurve]) -> list[Finding]:
    """Report each element whose μ is for a gain that nobody knows."""
    return [
        report(
            Code.GAIN_ASSUMED,
            "",
            element=element,
            gain=Number(curve.gain.value, "m^3"),
            percent=100.0 * curve.gain_spread,
        )
        for element, curve in curves.items()
        if curve.gain is not None and curve.gain.assumed
    ]


def report_gains(
    curves: Mapping[str, FrictionCurve], estimates: Mapping[str, Estimate]
) -> list[Finding]:
    """Report each element whose μ for the card's gain has an unusual size: the gain is suspect."""
    found = []
    for element, curve in curves.items():
        one = estimates.get(make_gain_id(element))
        if curve.gain is None or one is None or one.value is None or one.ci95_total is None:
            continue
        if curve.is_borrowed:
            continue
        mu, half = one.value / curve.gain.value, Z95 * (one.std_total or 0.0) / curve.gain.value
        if mu - half > USUAL_FRICTION[1] or mu + half < USUAL_FRICTION[0]:
            gain = Number(curve.gain.value, "m^3")
            low, high = (Number(one.value / limit, "m^3") for limit in reversed(USUAL_FRICTION))
            found.append(
                report(Code.GAIN_SUSPECT, "", element=element, mu=mu, gain=gain, low=low, high=high)
            )
    return found
