# SPDX-License-Identifier: MIT
"""Verdicts under disagreement of the logs, and friction points of all logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.estimation.result.multi_log import Consistency, LogPull
from drivetwin.estimation.result.verdict import join_reasons
from drivetwin.findings import Code, explain


def apply_consistency(told: EstimateSet, tested: Consistency) -> EstimateSet:
    """Apply the outcome of the homogeneity test; unchanged if the logs agree.

    A parameter on which they do not is weak at best, and its interval is as many times wider as
    the log that is farthest off is away in standard deviations (Birge 1932).
    """
    doubtful = tested.doubtful
    estimates = {
        name: _downgrade(one, doubtful[name]) if name in doubtful else one
        for name, one in told.estimates.items()
    }
    friction = {
        name: _widen(curve, doubtful.get(f"mu.{name}")) for name, curve in told.friction.items()
    }
    findings = told.findings if tested.agree else (tested.finding, *told.findings)
    return replace(told, estimates=estimates, friction=friction, findings=findings)


def _downgrade(one: Estimate, move: LogPull) -> Estimate:
    """Downgrade an estimate that one log contradicts by more than noise explains."""
    if one.value is None or one.std_noise is None or one.verdict is Verdict.DESIGN:
        return one
    factor = abs(move.z)
    reason = explain(Code.DISAGREEING_LOG, log=str(move.log), size=factor)
    text = join_reasons(reason, one.reason)
    return replace(one, std_noise=factor * one.std_noise, verdict=Verdict.WEAK, reason=text)


def _widen(curve: FrictionCurve, move: LogPull | None) -> FrictionCurve:
    if move is None:
        return curve
    half = 0.5 * abs(move.z) * (curve.mu_hi - curve.mu_lo)
    return replace(curve, mu_lo=curve.mu - half, mu_hi=curve.mu + half)


def pool_curves(alone: Sequence[Identification]) -> dict[str, FrictionCurve]:
    """Merge by element the curves of all logs over the slips that any log covers."""
    found: dict[str, list[FrictionCurve]] = {}
    for one in alone:
        for name, curve in one.friction.items():
            found.setdefault(name, []).append(curve)
    return {name: _pool(curves) for name, curves in found.items()}


def _pool(curves: Sequence[FrictionCurve]) -> FrictionCurve:
    """Extend the first curve over the slips of all; its μ is filled in by the common fit."""
    ends = np.concatenate([curve.slip[[0, -1]] for curve in curves])
    slip = np.linspace(ends.min(), ends.max(), curves[0].slip.size)
    nothing = np.zeros_like(slip)
    return replace(
        curves[0],
        slip=slip,
        mu=nothing,
        mu_lo=nothing,
        mu_hi=nothing,
        points_slip=np.concatenate([curve.points_slip for curve in curves]),
        points_mu=np.concatenate([curve.points_mu for curve in curves]),
    )
