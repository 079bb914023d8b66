# SPDX-License-Identifier: MIT
"""Homogeneity test of the logs of a joint fit, and the verdicts where they disagree.

At the common minimum, g_k is the gradient and F_k the information of log k on the shared unknowns
θ; its log-specific unknowns are eliminated (Schur complement). In coordinates in which the joint
covariance is the identity, G_k = Lᵀ F_k L has a row of information for each direction that the log
identifies, and

    χ² = min over δ of Σ_k ‖U_kᵀ δ·√w_k + U_kᵀ h_k/√w_k‖²,   G_k = U_k diag(w_k) U_kᵀ,  h_k = Lᵀ g_k

is χ² distributed with as many degrees of freedom as there are rows beyond the rank: the
homogeneity test of Cochran (1954) for vectors. Design priors take no part in it. How far each
parameter would move without one log, in standard deviations of that move, shows the source of an
inconsistency.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.direct.friction_law import evaluate_stribeck
from drivetwin.estimation.identification import Consistency, LogPull
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_variance_inflation
from drivetwin.estimation.likelihood.parametrization import LAW, RUN_SPECIFIC, map_log_names
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_jacobian,
    compute_parameters,
)
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, Verdict
from drivetwin.estimation.result.estimate_set import EstimateSet
from drivetwin.estimation.result.verdict import compute_covariance_root, join_reasons
from drivetwin.findings import Code, explain
from drivetwin.likelihood.covariance import invert_information, reduce_information
from drivetwin.likelihood.point import Prior


def apply_consistency(joint: EstimateSet, tested: Consistency) -> EstimateSet:
    """Apply the outcome of the homogeneity test; unchanged if the logs agree.

    A parameter on which they do not is weak at best, and its interval is as many times wider as
    the log that is farthest off is away in standard deviations (Birge 1932).
    """
    doubtful = tested.doubtful
    estimates = {
        name: _downgrade(one, doubtful[name]) if name in doubtful else one
        for name, one in joint.estimates.items()
    }
    friction = {
        name: _widen(curve, doubtful.get(f"mu.{name}")) for name, curve in joint.friction.items()
    }
    findings = joint.findings if tested.agree else (tested.finding, *joint.findings)
    return replace(joint, estimates=estimates, friction=friction, findings=findings)


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
    exact = curve.drop_gain_spread()
    half = 0.5 * abs(move.z) * (exact.mu_hi - exact.mu_lo)
    wide = replace(exact, mu_lo=curve.mu - half, mu_hi=curve.mu + half)
    return wide if curve.gain is None else wide.add_gain_spread(curve.gain)


LEAST_SHARE = 0.02
"""Share of the joint information on a direction below which a log is uninformative."""


@dataclass(frozen=True, eq=False)
class LogScore:
    """One log in the coordinates of the joint covariance: information (s, s) and pull (s,)."""

    log: int
    information: FloatArray
    pull: FloatArray


def check_consistency(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> Consistency:
    """Test the logs of `fit` against each other; `signals` as fitted, in the order of its parts."""
    logs = tuple(dict.fromkeys(s.log for s in signals))
    shared = find_shared(fit)
    covariance = invert_information(fit.normal.information)
    root = compute_covariance_root(covariance[np.ix_(shared, shared)])
    pulls = [_compute_column_products(fit, log, shared, root) for log in logs]
    square, freedom = compute_homogeneity(pulls)
    power = compute_variance_inflation(fit, np.eye(len(covariance))[shared])
    square /= power
    rows = _compute_rows(fit, signals, friction)
    projected = {name: row[shared] @ root for name, row in rows.items()}
    p = float(chdtrc(freedom, square)) if freedom else 1.0
    return Consistency(square, freedom, p, _find_discrepancies(pulls, projected, power))


def find_shared(fit: LikelihoodFit) -> list[int]:
    """Return the indices of the unknowns that all logs share."""
    structures = [term.plant for term in fit.problem.terms]
    own = {name for one in structures for name in map_log_names(one.log).values()}
    starts = {f"{one.label}.{key}" for one in structures for key in RUN_SPECIFIC}
    return [k for k, name in enumerate(fit.point.names) if name not in own | starts]


def _compute_column_products(
    fit: LikelihoodFit, log: int, shared: Sequence[int], root: FloatArray
) -> LogScore:
    """Compute information and gradient of one log on the shared unknowns at the common minimum.

    Raises IdentificationError where a simulation that the fit had made does not run again.
    """
    size = len(fit.point.names)
    terms = tuple(term for term in fit.problem.terms if term.plant.log == log)
    prior = fit.problem.prior
    own = [k for k, name in enumerate(fit.point.names) if name in map_log_names(log).values()]
    precision = np.zeros((size, size))
    precision[np.ix_(own, own)] = prior.precision[np.ix_(own, own)]
    alone = replace(fit.problem, terms=terms, prior=Prior(prior.mean, precision))
    normal = alone.normal(fit.point)
    if normal is None:
        raise IdentificationError(
            f"the simulation of log {log} fails at the common minimum", "identify it by itself"
        )
    rest = [k for k in range(size) if k not in shared and normal.information[k, k] > 0.0]
    information = root.T @ reduce_information(normal.information, list(shared), rest) @ root
    return LogScore(
        log, 0.5 * (information + information.T), root.T @ normal.gradient[list(shared)]
    )


def compute_homogeneity(pulls: Sequence[LogScore]) -> tuple[float, int]:
    """Compute χ² and its degrees of freedom over the directions that each log identifies."""
    rows, targets = [], []
    for one in pulls:
        power, directions = np.linalg.eigh(one.information)
        keep = power > LEAST_SHARE
        weight = np.sqrt(power[keep])
        rows.append(weight[:, None] * directions[:, keep].T)
        targets.append(-(directions[:, keep].T @ one.pull) / weight)
    matrix, target = np.vstack(rows), np.concatenate(targets)
    delta, _, rank, _ = np.linalg.lstsq(matrix, target, rcond=1e-9)
    left = target - matrix @ delta
    return float(left @ left), int(matrix.shape[0] - rank)


def _find_discrepancies(
    pulls: Sequence[LogScore], projected: Mapping[str, FloatArray], widened: float
) -> tuple[LogPull, ...]:
    """Find the largest discrepancy of every parameter over the logs."""
    largest: dict[str, LogPull] = {}
    for one in pulls:
        power, directions = np.linalg.eigh(one.information)
        share = np.clip(power, 0.0, 1.0 - LEAST_SHARE)
        for name, row in projected.items():
            along = directions.T @ row
            move = -along @ ((directions.T @ one.pull) / (1.0 - share))
            std = np.sqrt(widened * along**2 @ (share / (1.0 - share)))
            z = float(move / std) if std > LEAST_SHARE * np.linalg.norm(row) else 0.0
            if name not in largest or abs(z) > abs(largest[name].z):
                largest[name] = LogPull(name, one.log, z)
    return tuple(largest.values())


def _compute_rows(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> dict[str, FloatArray]:
    """Compute the derivative (p,) by the unknowns of every shared parameter, and of friction."""
    names = list(compute_parameters(fit.problem, fit.point, signals))
    matrix = compute_jacobian(fit.problem, fit.point, np.sqrt(np.diag(fit.covariance)), signals)
    own = np.setdiff1d(np.arange(len(fit.point.names)), find_shared(fit))
    rows = {
        name: row
        for name, row in zip(names, matrix, strict=True)
        if np.any(row) and not np.any(row[own])
    }
    for element, curve in friction.items():
        if curve.is_borrowed:
            continue
        index = [fit.point.names.index(f"{element}.{key}") for key in LAW]
        middle = np.array([np.mean(curve.slip[[0, -1]])])
        row = np.zeros(len(fit.point.names))
        row[index] = evaluate_stribeck(fit.point.values[index], middle)[1][:, 0]
        rows[f"mu.{element}"] = row
    return rows
