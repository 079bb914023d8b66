# SPDX-License-Identifier: MIT
"""Verdict of friction: μ times gain as a parameter, and μ for the gain on the vehicle card."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.estimation.result.verdict import assess, join_reasons
from drivetwin.findings import Code, Finding, Number, explain, report
from drivetwin.parameters import OVER_ETA
from drivetwin.vehicle.spec import PriorValue

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
    mu, low, high = (
        float(np.interp(curve.middle_slip, curve.slip, each))
        for each in (curve.mu, curve.mu_lo, curve.mu_hi)
    )
    total = (high - low) / (2.0 * Z95)
    std = float(np.sqrt(max(total**2 - (mu * curve.gain_spread) ** 2, 0.0)))
    return curve.gain.value * mu, curve.gain.value * std


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
