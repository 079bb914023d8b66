# SPDX-License-Identifier: MIT
"""Homogeneity test of the logs of a joint fit.

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
from scipy.stats import chi2

from drivetwin.errors import IdentificationError
from drivetwin.identify.friction import stribeck
from drivetwin.identify.likelihood.derived import parameters, slopes
from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.noise_power import noise_power
from drivetwin.identify.likelihood.null_space import reduced
from drivetwin.identify.likelihood.unknowns import LAW, OF_RUN, own_of
from drivetwin.identify.regression import Prior
from drivetwin.identify.result import FrictionCurve
from drivetwin.identify.signals import FloatArray, ShiftSignals
from drivetwin.identify.uncertainty import root_of

TOLD = 0.02
"""Share of the joint information on a direction below which a log is uninformative."""
SIGNIFICANT = 0.01
"""Probability of χ² under agreeing logs below which they are said to disagree."""
FAR = 3.0
"""Move of a parameter without one log, in standard deviations of it, from which it is named."""


@dataclass(frozen=True)
class Move:
    """Discrepancy between one log and the others on a parameter, in its standard deviations."""

    parameter: str
    log: int
    z: float


@dataclass(frozen=True)
class Consistency:
    """Homogeneity of the logs: χ² on `freedom` degrees, `p` its probability if they agree.

    `moves` has the largest move of every shared parameter, by id; `mu.<element>` stands for the
    friction in the middle of the slip range seen. A log that does not tell one moves it by 0.
    """

    chi2: float
    freedom: int
    p: float
    moves: tuple[Move, ...]

    @property
    def agree(self) -> bool:
        """True if the logs are consistent with one vehicle in one state."""
        return self.p >= SIGNIFICANT

    @property
    def doubtful(self) -> dict[str, Move]:
        """Parameters on which the logs disagree; empty if they agree."""
        far = {one.parameter: one for one in self.moves if abs(one.z) > FAR}
        return {} if self.agree else far

    @property
    def text(self) -> str:
        """Outcome as a sentence."""
        figures = f"χ² {self.chi2:.1f} on {self.freedom}, p = {self.p:.2g}"
        if self.agree:
            return f"the logs agree on what they share ({figures})"
        far = sorted(self.doubtful.values(), key=lambda one: -abs(one.z))
        named = ", ".join(f"{one.parameter} (log {one.log}, {one.z:+.1f} σ)" for one in far)
        tail = f"; most apart: {named}" if named else ""
        return f"the logs do not agree on what they share ({figures}){tail}"


@dataclass(frozen=True, eq=False)
class Pull:
    """One log in the coordinates of the joint covariance: information (s, s) and pull (s,)."""

    log: int
    information: FloatArray
    pull: FloatArray


def consistency(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> Consistency:
    """Test the logs of `fit` against each other; `signals` as fitted, in the order of its parts."""
    logs = tuple(dict.fromkeys(s.log for s in signals))
    shared = shared_of(fit)
    covariance = covariance_of(fit.normal.information)
    root = root_of(covariance[np.ix_(shared, shared)])
    pulls = [_pull(fit, log, shared, root) for log in logs]
    square, freedom = homogeneity(pulls)
    power = noise_power(fit, np.eye(len(covariance))[shared])
    square /= power
    rows = _rows(fit, signals, friction)
    told = {name: row[shared] @ root for name, row in rows.items()}
    p = float(chi2.sf(square, freedom)) if freedom else 1.0
    return Consistency(square, freedom, p, _moves(pulls, told, power))


def shared_of(fit: LikelihoodFit) -> list[int]:
    """Return the indices of the unknowns that all logs share."""
    structures = [part.structure for part in fit.problem.parts]
    own = {name for one in structures for name in own_of(one.log).values()}
    starts = {f"{one.label}.{key}" for one in structures for key in OF_RUN}
    return [k for k, name in enumerate(fit.point.names) if name not in own | starts]


def _pull(fit: LikelihoodFit, log: int, shared: Sequence[int], root: FloatArray) -> Pull:
    """Compute information and gradient of one log on the shared unknowns at the common minimum.

    Raises IdentificationError where a simulation that the fit had made does not run again.
    """
    size = len(fit.point.names)
    parts = tuple(part for part in fit.problem.parts if part.structure.log == log)
    prior = fit.problem.prior
    own = [k for k, name in enumerate(fit.point.names) if name in own_of(log).values()]
    precision = np.zeros((size, size))
    precision[np.ix_(own, own)] = prior.precision[np.ix_(own, own)]
    alone = replace(fit.problem, parts=parts, prior=Prior(prior.mean, precision))
    normal = alone.normal(fit.point)
    if normal is None:
        raise IdentificationError(
            f"the simulation of log {log} fails at the common minimum", "identify it by itself"
        )
    rest = [k for k in range(size) if k not in shared and normal.information[k, k] > 0.0]
    told = root.T @ reduced(normal.information, list(shared), rest) @ root
    return Pull(log, 0.5 * (told + told.T), root.T @ normal.gradient[list(shared)])


def homogeneity(pulls: Sequence[Pull]) -> tuple[float, int]:
    """Compute χ² and its degrees of freedom over the directions that each log identifies."""
    rows, targets = [], []
    for one in pulls:
        power, directions = np.linalg.eigh(one.information)
        keep = power > TOLD
        weight = np.sqrt(power[keep])
        rows.append(weight[:, None] * directions[:, keep].T)
        targets.append(-(directions[:, keep].T @ one.pull) / weight)
    matrix, target = np.vstack(rows), np.concatenate(targets)
    delta, _, rank, _ = np.linalg.lstsq(matrix, target, rcond=1e-9)
    left = target - matrix @ delta
    return float(left @ left), int(matrix.shape[0] - rank)


def _moves(
    pulls: Sequence[Pull], told: Mapping[str, FloatArray], widened: float
) -> tuple[Move, ...]:
    """Find the largest discrepancy of every parameter over the logs."""
    largest: dict[str, Move] = {}
    for one in pulls:
        power, directions = np.linalg.eigh(one.information)
        share = np.clip(power, 0.0, 1.0 - TOLD)
        for name, row in told.items():
            along = directions.T @ row
            move = -along @ ((directions.T @ one.pull) / (1.0 - share))
            std = np.sqrt(widened * along**2 @ (share / (1.0 - share)))
            z = float(move / std) if std > TOLD * np.linalg.norm(row) else 0.0
            if name not in largest or abs(z) > abs(largest[name].z):
                largest[name] = Move(name, one.log, z)
    return tuple(largest.values())


def _rows(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], friction: Mapping[str, FrictionCurve]
) -> dict[str, FloatArray]:
    """Compute the derivative (p,) by the unknowns of every shared parameter, and of friction."""
    names = list(parameters(fit.problem, fit.point, signals))
    matrix = slopes(fit.problem, fit.point, np.sqrt(np.diag(fit.covariance)), signals)
    own = np.setdiff1d(np.arange(len(fit.point.names)), shared_of(fit))
    rows = {
        name: row
        for name, row in zip(names, matrix, strict=True)
        if np.any(row) and not np.any(row[own])
    }
    for element, curve in friction.items():
        index = [fit.point.names.index(f"{element}.{key}") for key in LAW]
        middle = np.array([np.mean(curve.slip[[0, -1]])])
        row = np.zeros(len(fit.point.names))
        row[index] = stribeck(fit.point.values[index], middle)[1][:, 0]
        rows[f"mu.{element}"] = row
    return rows
