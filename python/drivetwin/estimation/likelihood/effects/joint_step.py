# SPDX-License-Identifier: MIT
"""One Gauss-Newton step in the unknowns and the amounts of all effects together.

With F the information of the unknowns, g the gradient of Q/2, J the slopes of the compared
samples, r their residual, W = Σ⁻¹ and Z the columns of the effects, whose amounts a are normal
about zero with unit variance:

    M = [[F, JᵀWZ], [ZᵀWJ, ZᵀWZ + 1]],   (Δθ, a) = M⁻¹·(-g, ZᵀWr)

The covariance of the unknowns is the upper left block of M⁻¹ (Schur complement). The log evidence
of one group of columns alone is that of `column_products`. The gradient is not left out: what
remains of it at the end of a search would look like an effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.columns import EffectColumns
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.estimation.result.cause import Group
from drivetwin.likelihood.coloured_noise import compute_long_run_excess
from drivetwin.likelihood.column_products import (
    AdjustedColumns,
    adjust_unknowns,
    compute_column_products,
    weigh_amounts,
)
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.point import (
    NormalEquations,
    join_columns,
    scale_columns,
    select_columns,
)


@dataclass(frozen=True)
class SizeSettings:
    """Settings of the prior sizes by evidence."""

    spread: float = 2.3
    """Standard deviation of the logarithm of an effect's size about the stated one: a factor of
    ten. A smaller one keeps intervals wide for effects that the log excludes, a larger one lets
    hardly visible effects vanish."""
    farthest: float = 4.6
    """Largest change of that logarithm: two standard deviations."""
    nodes: int = 15
    """Sizes over which an effect is averaged: steps of a factor of two."""
    tolerance: float = 1e-6
    """Gradient of the log evidence by the logarithm of a size at which the search ends."""


SIZES = SizeSettings()


@dataclass(frozen=True, eq=False)
class WeightedColumns:
    """Weighted sums over all shifts for the columns of the effects.

    `own` (q, q) is ZᵀWZ, `cross` (p, q) JᵀWZ, `pull` (q,) ZᵀWr, `gradient` (p,) that of Q/2, the
    stated values of effects taken out of r. `weighted` (n, q) is WZ of each shift.
    """

    columns: EffectColumns
    own: FloatArray
    cross: FloatArray
    pull: FloatArray
    gradient: FloatArray
    weighted: tuple[FloatArray, ...]

    def rescale(self, scale: FloatArray) -> WeightedColumns:
        """Return the sums of the columns multiplied by `scale` (q,)."""
        return replace(
            self,
            columns=self.columns.rescale(scale),
            own=self.own * np.outer(scale, scale),
            cross=self.cross * scale,
            pull=self.pull * scale,
            weighted=tuple(scale_columns(one, scale) for one in self.weighted),
        )

    def join(self, information: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return gradient (p+q,) and information (p+q, p+q) of unknowns, of which that is
        `information` (p, p), and amounts together."""
        own = self.own + np.eye(self.pull.size)
        joint = np.block([[information, self.cross], [self.cross.T, own]])
        return np.concatenate([self.gradient, -self.pull]), joint

    def adjust(self, information: FloatArray, chi2: float) -> AdjustedColumns:
        """Adjust the unknowns, for residual power `chi2` per sample and at least that of noise."""
        return adjust_unknowns(*self.join(information), self.gradient.size, max(chi2, 1.0))

    def select(self, picked: list[int]) -> WeightedColumns:
        """Return the sums of some of the columns."""
        return replace(
            self,
            columns=self.columns.select(picked),
            own=self.own[np.ix_(picked, picked)],
            cross=self.cross[:, picked],
            pull=self.pull[picked],
            weighted=tuple(select_columns(one, picked) for one in self.weighted),
        )


@dataclass(frozen=True, eq=False)
class GroupEvidence:
    """Evidence of one group alone: `nats` is the log of the ratio of its likelihood to that
    without it, `amounts` (k,) its posterior mean in prior standard deviations, `answer` (q,) the
    weighted scalar products of its fitted effect with all columns, the unknowns adjusted.
    `columns` (k,) are its numbers, `std` (k,) the standard deviations of the amounts, `moves` (p,)
    what the unknowns move by them, those of the fit first."""

    nats: float
    amounts: FloatArray
    std: FloatArray
    columns: tuple[int, ...]
    answer: FloatArray
    moves: FloatArray

    @property
    def power(self) -> float:
        """Weighted sum of squares of its fitted effect, the unknowns adjusted."""
        return max(float(self.answer[list(self.columns)] @ self.amounts), 0.0)


@dataclass(frozen=True, eq=False)
class JointStep:
    """Step in p unknowns and q amounts.

    `moves` (p,) and `amounts` (q,), `inverse` (p+q, p+q) is M⁻¹, `excess` (p+q, p+q) the variance
    of the gradient by slow errors, `chi2` the residual power per sample after the step, at least
    1. `residuals` are the corrected ones (n,) by shift. `contributions` (p,) by group are the
    moves of the unknowns that its amounts cause.
    """

    columns: EffectColumns
    moves: FloatArray
    amounts: FloatArray
    inverse: FloatArray
    excess: FloatArray
    chi2: float
    residuals: tuple[FloatArray, ...]
    contributions: Mapping[Group, FloatArray]

    @property
    def covariance(self) -> FloatArray:
        """Covariance (p+q, p+q) of unknowns and amounts."""
        return self.chi2 * self.inverse + self.inverse @ self.excess @ self.inverse

    @property
    def std(self) -> FloatArray:
        """Standard deviations (q,) of the amounts."""
        own = self.covariance[self.moves.size :, self.moves.size :]
        return np.asarray(np.sqrt(np.diag(own)))


def weight_columns(
    problem: DualClutchProblem, normal: NormalEquations, columns: EffectColumns
) -> WeightedColumns:
    """Compute the weighted sums of `columns` at the point of the expansion `normal`."""
    score = compute_column_products(problem, normal, columns.matrices)
    pull, gradient = score.pull.copy(), normal.gradient.copy()
    for known, weighted, regressors in zip(
        columns.known, score.weighted, normal.regressors, strict=True
    ):
        pull -= weighted.T @ known
        gradient += regressors.T @ known
    return WeightedColumns(columns, score.own, score.cross, pull, gradient, score.weighted)


def scale_by_evidence(
    sums: WeightedColumns, information: FloatArray, chi2: float
) -> tuple[WeightedColumns, Mapping[Group, float]]:
    """Scale the columns of each group to the likeliest prior size, all groups together.

    The maximum of the log evidence with a normal prior on the logarithms u of the sizes. With the
    posterior means a and variances v of the amounts in prior standard deviations, its slope by u
    of a group is Σ(a² + v - 1) - u/spread² (MacKay, Neural Computation 4, 1992). Stated sensor
    tolerances stay. Returns the scaled sums and u of each group that was scaled.
    """
    from scipy.optimize import minimize

    effects = [one for one in dict.fromkeys(sums.columns.groups) if one.effect is not None]
    if not effects:
        return sums, {}
    adjusted = sums.adjust(information, chi2)
    own, pull = adjusted.own, adjusted.pull
    members = np.array([[one == group for one in sums.columns.groups] for group in effects], float)

    def evaluate(logs: FloatArray) -> tuple[float, FloatArray]:
        """Return minus the log posterior of the sizes, and its gradient."""
        scale = np.exp(logs @ members)
        one = weigh_amounts(np.outer(scale, scale) * own, scale * pull)
        slope = members @ (one.amounts**2 + np.diag(one.spread) - 1.0)
        prior = logs / SIZES.spread**2
        return 0.5 * float(logs @ prior) - one.nats, prior - slope

    found = minimize(
        evaluate,
        np.zeros(len(effects)),
        jac=True,
        method="L-BFGS-B",
        bounds=[(-SIZES.farthest, SIZES.farthest)] * len(effects),
        options={"gtol": SIZES.tolerance, "ftol": 0.0},
    )
    sizes = dict(zip(effects, found.x.tolist(), strict=True))
    return sums.rescale(np.exp(found.x @ members)), sizes


def compute_size_spread(step: JointStep, sizes: Mapping[Group, float]) -> FloatArray:
    """Compute the covariance (p+q, p+q) of the estimates of unknowns and amounts over the sizes
    that the effects may have.

    A posterior at the likeliest sizes is too narrow: the estimates differ between sizes (Kass and
    Steffey, JASA 84, 1989). `sizes` are the logarithms of the likeliest ones over the stated ones;
    that of one group at a time varies by its posterior. Another size is another prior precision of
    the amounts of the group, hence a change of rank k of M (Woodbury).
    """
    answer = np.concatenate([step.moves, step.amounts])
    total = np.zeros_like(step.inverse)
    for group, size in sizes.items():
        own = step.moves.size + np.array(step.columns.find_columns(group), dtype=int)
        block, pull, one = step.inverse[np.ix_(own, own)], answer[own], np.eye(own.size)
        logs = np.linspace(-SIZES.farthest, SIZES.farthest, SIZES.nodes)
        nats, moves = np.empty(logs.size), np.empty((logs.size, own.size))
        for k, log in enumerate(logs):
            tighter = np.exp(-2.0 * (log - size)) - 1.0
            change = one + tighter * block
            moves[k] = -tighter * np.linalg.solve(change, pull)
            nats[k] = 0.5 * float(pull @ moves[k]) / step.chi2
            nats[k] -= 0.5 * float(np.linalg.slogdet(change)[1]) + own.size * (log - size)
            nats[k] -= 0.5 * (log / SIZES.spread) ** 2
        weights = np.exp(nats - np.max(nats))
        weights /= np.sum(weights)
        apart = (moves - weights @ moves) @ step.inverse[own]
        total += apart.T @ (weights[:, None] * apart)
    return total


def compute_evidence(
    sums: WeightedColumns, information: FloatArray, chi2: float
) -> dict[Group, GroupEvidence]:
    """Compute the evidence of each group alone, with residual power `chi2` per sample.

    Stated tolerances of sensors act in any case: beside an effect they are unknowns as those of
    the fit. The evidence of a tolerance itself is that of the error against its absence.
    """
    groups = dict.fromkeys(sums.columns.groups)
    sensors = [one for one in groups if one.effect is None]
    found = _evaluate_groups(sums, information, chi2, sensors)
    effects = [one for one in groups if one.effect is not None]
    beside = _evaluate_groups(*_join_tolerances(sums, information), chi2, effects)
    return {one: (found | beside)[one] for one in groups}


def _evaluate_groups(
    sums: WeightedColumns, information: FloatArray, chi2: float, groups: Sequence[Group]
) -> dict[Group, GroupEvidence]:
    """Compute the evidence of some groups beside unknowns of this `information`."""
    adjusted = sums.adjust(information, chi2)
    found = {}
    for group in groups:
        k = sums.columns.find_columns(group)
        one = weigh_amounts(adjusted.own[np.ix_(k, k)], adjusted.pull[k])
        found[group] = GroupEvidence(
            one.nats,
            one.amounts,
            np.sqrt(np.diag(one.spread)),
            tuple(k),
            adjusted.own[:, k] @ one.amounts,
            adjusted.moves[:, k] @ one.amounts,
        )
    return found


def _join_tolerances(
    sums: WeightedColumns, information: FloatArray
) -> tuple[WeightedColumns, FloatArray]:
    """Return the sums and the information with the tolerances of sensors among the unknowns.

    The columns themselves stay.
    """
    sensors = [k for k, one in enumerate(sums.columns.groups) if one.effect is None]
    own = sums.own[np.ix_(sensors, sensors)] + np.eye(len(sensors))
    cross = sums.cross[:, sensors]
    joined = replace(
        sums,
        cross=np.vstack([sums.cross, sums.own[sensors]]),
        gradient=np.concatenate([sums.gradient, -sums.pull[sensors]]),
    )
    return joined, np.block([[information, cross], [cross.T, own]])


def take_joint_step(
    problem: DualClutchProblem, normal: NormalEquations, sums: WeightedColumns
) -> JointStep:
    """Step from the expansion `normal` in the unknowns and the amounts of the effects."""
    size = normal.gradient.size
    gradient, matrix = sums.join(normal.information)
    inverse = invert_information(matrix)
    step = -inverse @ gradient
    moves, amounts = step[:size], step[size:]
    residuals = tuple(
        residual - known - slopes @ moves - z @ amounts
        for residual, known, slopes, z in zip(
            normal.residuals, sums.columns.known, normal.slopes, sums.columns.matrices, strict=True
        )
    )
    power = sum(
        float(one @ term.weighting.apply_inverse(one))
        for one, term in zip(residuals, problem.terms, strict=True)
    )
    chi2 = max(power / problem.size, 1.0)
    corrected = replace(
        normal,
        information=matrix,
        residuals=residuals,
        regressors=tuple(
            join_columns(*both) for both in zip(normal.regressors, sums.weighted, strict=True)
        ),
    )
    follows = sums.adjust(normal.information, chi2).moves
    contributions = {
        group: follows[:, k] @ amounts[k]
        for group in dict.fromkeys(sums.columns.groups)
        for k in [sums.columns.find_columns(group)]
    }
    return JointStep(
        sums.columns,
        moves,
        amounts,
        inverse,
        compute_long_run_excess(problem, corrected, chi2),
        chi2,
        residuals,
        contributions,
    )
