# SPDX-License-Identifier: MIT
"""Correction of a fit for the effects that the model leaves out."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.columns import (
    EffectColumns,
    EffectPriors,
    build_columns,
    compute_inputs,
    number_groups,
)
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.joint_step import (
    GroupEvidence,
    JointStep,
    WeightedColumns,
    compute_size_spread,
    take_joint_step,
    weight_columns,
)
from drivetwin.estimation.likelihood.fit import LikelihoodFit, PlantEvidence
from drivetwin.estimation.likelihood.parametrization import DualClutchProblem
from drivetwin.estimation.result.cause import Group
from drivetwin.likelihood.budget import limit_evaluations
from drivetwin.likelihood.covariance import compute_covariance, invert_information
from drivetwin.likelihood.point import NormalEquations, ParameterVector


@dataclass(frozen=True)
class CorrectionSettings:
    """Settings of the correction for effects."""

    linear_moves: float = 0.5
    """Largest move of an unknown, in its new standard deviations, up to which one step is taken:
    the error of a linear step is of second order in it."""
    settled: float = 0.1
    """Change of an unknown by a further step, in its new standard deviations, from which on the
    steps end: it is small beside any interval."""
    more_steps: int = 8
    """Greatest number of steps after the first: with extrapolation five are enough, unless the
    effects are beyond a linear correction."""
    memory: int = 3
    """Number of earlier steps from which a step is extrapolated: as many directions as may
    converge slowly."""
    reach: float = 10.0
    """Largest extrapolation of a step, in the largest change by that step: changes that shrink by a
    tenth a step."""
    condition: float = 1e-3
    """Least singular value of the changes of these steps, over the largest, that is used: below it
    is what steps miss of a linear iteration."""
    shortest_step: float = 0.1
    """Share of the first step below which the second is not tried."""
    largest_power: float = 10.0
    """Largest residual power where columns are recomputed, over that of the fit and at least that
    of noise: beyond it the columns are not those of the log's motion, and steps diverge."""


CORRECTION = CorrectionSettings()


@dataclass(frozen=True, eq=False)
class Correction:
    """Fit corrected for effects.

    `mean` are the corrected unknowns with `covariance` (p, p) (total) and `noise` (p, p), that of
    noise alone. `inverse` (p, p) is the inverse of their information, priors included, beside the
    amounts that move them: nothing widens it. `step` is the last joint step, `spread` (p+q, p+q)
    what uncertain sizes of the effects add to its covariance; `last` (p,) the move of the unknowns
    between the last two steps, zero where one was enough. `evidence` is that of each group at the
    minimum of the fit.
    """

    mean: ParameterVector
    covariance: FloatArray
    noise: FloatArray
    inverse: FloatArray
    step: JointStep
    spread: FloatArray
    last: FloatArray
    evidence: Mapping[Group, GroupEvidence]

    @property
    def joint_covariance(self) -> FloatArray:
        """Covariance (p+q, p+q) of unknowns and amounts of the effects."""
        joint = self.step.covariance + self.spread
        size = self.mean.values.size
        joint[:size, :size] = self.covariance
        return joint

    @property
    def residuals(self) -> tuple[FloatArray, ...]:
        """Residuals (n,) of each shift with the effects taken out."""
        return self.step.residuals


def correct_fit(
    fit: LikelihoodFit, priors: EffectPriors, more_steps: int = CORRECTION.more_steps
) -> Correction | None:
    """Estimate the unknowns with all effects at their priors; None without a linear response.

    Effects with evidence move the values. The others have a posterior mean too; it is not applied,
    and the variance grows by its square. The first step is from the minimum of the fit. Where it
    leaves the range in which the columns are linear, they are recomputed where it ends, and
    another step is taken from there, at most `more_steps` times. A step holds the columns fixed
    while the unknowns move, so that steps may shrink slowly: they are extrapolated (Anderson,
    Journal of the ACM 12, 1965). Effects without evidence move nothing: their columns are
    recomputed where the steps end.
    """
    found = expand_effects(fit, priors)
    if found is None:
        return None
    sums, shown, evidence = found.sums, found.shown, dict(found.evidence)
    if fit.plant is not None:
        evidence |= _describe_plant(fit, fit.plant, sums.pull.size)
    base = _Expansion(fit.problem, fit.normal, fit.point, sums, None)
    moving = base.select(shown)
    step = moving.take_step()
    moves, amounts = step.moves, _Amounts(moving.sums.columns, step.amounts)
    change, last, limit = moves, np.zeros_like(moves), CORRECTION.linear_moves
    answers: list[_Answer] = []
    tried: list[_Tried] = []
    for _ in range(more_steps):
        std = np.sqrt(np.diag(step.covariance)[: moves.size])
        if np.max(np.abs(change) / std) <= limit:
            break
        again = _expand_again(fit, moves, priors, amounts)
        if again is None:
            tried.clear()
            last = np.full_like(moves, np.inf)
            break
        step = again.take_step()
        end = again.point.values + step.moves - fit.point.values
        change = end - moves
        reached = _Amounts(again.sums.columns, step.amounts)
        answers.append(_Answer(end, reached, std, change / std))
        tried.append(_Tried(again, change, step.chi2))
        if _is_diverging(answers):
            break
        moves, amounts = _extrapolate(answers[-CORRECTION.memory - 1 :])
        limit = CORRECTION.settled
    if tried:
        closest = _find_closest(tried, answers)
        whole = _complete(fit, base, closest.base, priors)
        base, last = (
            (base, np.full_like(last, np.inf)) if whole is None else (whole, closest.change)
        )
    return _conclude(fit, base, shown, last, evidence, found.sizes)


def _is_diverging(answers: Sequence[_Answer]) -> bool:
    """Return whether the unknowns moved farther in each of the last two steps than in that
    before."""
    sizes = [float(np.max(np.abs(one.change))) for one in answers[-3:]]
    return len(sizes) == 3 and sizes[0] < sizes[1] < sizes[2]


def _describe_plant(
    fit: LikelihoodFit, plant: PlantEvidence, columns: int
) -> dict[Group, GroupEvidence]:
    """Describe the added element as a group without columns; its amount is its size."""
    own = fit.problem.terms[0].plant.plant_effect
    assert own is not None, "the plant has an effect"
    first = fit.point.values[plant.index]
    size = own.get_size(float(first))
    std = float(np.sqrt(fit.covariance[plant.index, plant.index]))
    std *= 1.0 if own.is_signed else size
    amounts, stds = np.array([size]), np.array([std])
    answer = np.zeros(columns)
    return {Group(plant.effect): GroupEvidence(plant.nats, amounts, stds, (), answer, plant.moves)}


def keep_fit(fit: LikelihoodFit) -> Correction:
    """Return a fit as it is, for one without a linear response: no effect is estimated."""
    size = fit.point.values.size
    inverse = invert_information(fit.normal.information)
    none = EffectColumns((), (), (), np.empty(0), ())
    step = JointStep(
        columns=none,
        moves=np.zeros(size),
        amounts=np.empty(0),
        inverse=inverse,
        excess=np.zeros((size, size)),
        chi2=max(fit.chi2, 1.0),
        residuals=fit.normal.residuals,
        contributions={},
    )
    return Correction(
        mean=fit.point,
        covariance=fit.covariance,
        noise=fit.covariance,
        inverse=inverse,
        step=step,
        spread=np.zeros((size, size)),
        last=np.zeros(size),
        evidence={},
    )


@dataclass(frozen=True, eq=False)
class _Expansion:
    """Point, expansion of Q there, and the weighted sums of columns; `driving` are the amounts that
    drive the runs, None for none."""

    problem: DualClutchProblem
    normal: NormalEquations
    point: ParameterVector
    sums: WeightedColumns
    driving: _Amounts | None

    def select(self, groups: Collection[Group]) -> _Expansion:
        """Return the expansion with the columns of some `groups`."""
        named = enumerate(self.sums.columns.groups)
        return replace(self, sums=self.sums.select([k for k, one in named if one in groups]))

    def take_step(self) -> JointStep:
        """Take the joint step with all columns."""
        return take_joint_step(self.problem, self.normal, self.sums)


@dataclass(frozen=True, eq=False)
class _Amounts:
    """Columns of effects with their amounts (q,)."""

    columns: EffectColumns
    values: FloatArray

    def spread_over(self, columns: EffectColumns) -> _Amounts:
        """Return the amounts among more `columns`, zero for the others."""
        keys = number_groups(columns.groups)
        values = np.zeros(len(keys))
        values[[keys.index(one) for one in number_groups(self.columns.groups)]] = self.values
        return _Amounts(columns, values)


@dataclass(frozen=True, eq=False)
class _Answer:
    """End of a step: `moves` (p,) of the unknowns from the minimum, amounts of the effects, the
    standard deviations `std` (p,) of the unknowns, and the `change` (p,) of the moves by the step
    in these."""

    moves: FloatArray
    amounts: _Amounts
    std: FloatArray
    change: FloatArray


@dataclass(frozen=True, eq=False)
class _Tried:
    """Expansion of a step, the `change` (p,) of the unknowns by it, and the residual power after
    it."""

    base: _Expansion
    change: FloatArray
    chi2: float


def _find_closest(tried: Sequence[_Tried], answers: Sequence[_Answer]) -> _Tried:
    """Return the last step, or the one that comes closest to the log where they did not settle.

    Steps may leave the minimum again: an element then locks at another time, and the columns of
    the effects are those of another motion.
    """
    if np.max(np.abs(answers[-1].change)) <= CORRECTION.settled:
        return tried[-1]
    return min(reversed(tried), key=lambda one: one.chi2)


def _complete(
    fit: LikelihoodFit, first: _Expansion, base: _Expansion, priors: EffectPriors
) -> _Expansion | None:
    """Expand with the columns of all effects where a step with those that move values started."""
    assert base.driving is not None, "a further step drives the runs"
    driving = base.driving.spread_over(first.sums.columns)
    with limit_evaluations(np.inf):
        return _expand_with_inputs(fit.problem, base.point, priors, driving)


def _extrapolate(answers: Sequence[_Answer]) -> tuple[FloatArray, _Amounts]:
    """Return moves and amounts to which the answers of consecutive steps lead.

    The combination of the answers whose change is least; the last one alone where the steps do not
    have the same columns.
    """
    *before, last = answers
    values = last.amounts.values
    if not before or any(one.amounts.values.size != values.size for one in before):
        return last.moves, last.amounts
    apart = np.column_stack([last.change - one.change for one in before])
    factors, *_ = np.linalg.lstsq(apart, -last.change, rcond=CORRECTION.condition)
    moves = np.column_stack([last.moves - one.moves for one in before]) @ factors
    ahead = np.column_stack([values - one.amounts.values for one in before]) @ factors
    farthest = float(np.max(np.abs(moves / last.std)))
    share = min(1.0, CORRECTION.reach * float(np.max(np.abs(last.change))) / max(farthest, 1e-300))
    return last.moves + share * moves, replace(last.amounts, values=values + share * ahead)


def _conclude(
    fit: LikelihoodFit,
    base: _Expansion,
    shown: Collection[Group],
    last: FloatArray,
    evidence: Mapping[Group, GroupEvidence],
    sizes: Mapping[Group, float],
) -> Correction:
    """Compute values and covariances at the last expansion."""
    step, chosen = base.take_step(), base.select(shown).take_step()
    size = last.size
    rest = step.moves - chosen.moves
    extra = _compute_model_spread(fit)
    spread = compute_size_spread(step, sizes)
    values = base.point.values + chosen.moves
    mean = fit.point.replace_values(np.clip(values, fit.problem.lower, fit.problem.upper))
    if any(term.evaluate(mean) is None for term in fit.problem.terms):
        mean, last = fit.point, np.full_like(last, np.inf)  # no vehicle has such values
    return Correction(
        mean,
        (step.covariance + spread)[:size, :size] + np.outer(rest, rest) + extra,
        _compute_noise(base.normal, step) + extra,
        chosen.inverse[:size, :size],
        step,
        spread,
        last,
        evidence,
    )


def _expand_again(
    fit: LikelihoodFit, moves: FloatArray, priors: EffectPriors, amounts: _Amounts
) -> _Expansion | None:
    """Recompute the columns at the end of the first step of `moves` (p,).

    Where no run completes there, or the residual is beyond `largest_power`, the step is halved.
    """
    share, largest = 1.0, CORRECTION.largest_power * max(fit.chi2, 1.0) * fit.problem.size
    with limit_evaluations(np.inf):
        while share > CORRECTION.shortest_step:
            values = fit.problem.retract(fit.point, share * moves)
            values = np.clip(values, fit.problem.lower, fit.problem.upper)
            acting = _Amounts(amounts.columns, share * amounts.values)
            point = fit.point.replace_values(values)
            found = _expand_with_inputs(fit.problem, point, priors, acting)
            if found is not None and found.normal.cost <= largest:
                return found
            share *= 0.5
    return None


def _expand_with_inputs(
    problem: DualClutchProblem, point: ParameterVector, priors: EffectPriors, amounts: _Amounts
) -> _Expansion | None:
    """Expand Q at `point` with effects in the inputs; None if a run does not complete.

    The effects that act through inputs drive the run with their `amounts`, so they are no longer
    linear; the others stay columns.
    """
    first = amounts.columns
    acting = amounts.values * first.acts_on_inputs
    changes = compute_inputs(problem, point, priors, first, acting)
    if changes is None:
        return None
    terms = [
        term.add_to_inputs(point, one) for term, one in zip(problem.terms, changes, strict=True)
    ]
    problem = replace(problem, terms=tuple(terms))
    normal = problem.normal(point)
    second = first.plan_second_step(amounts.values)
    columns = None if normal is None else build_columns(problem, point, priors, second)
    if normal is None or columns is None:
        return None
    sums = weight_columns(problem, normal, columns.follow(first, acting))
    return _Expansion(problem, normal, point, sums, amounts)


def _compute_model_spread(fit: LikelihoodFit) -> FloatArray:
    """Compute what averaging over models added to the covariance (p, p) of a fit; semidefinite."""
    extra = fit.covariance - compute_covariance(fit.problem, fit.normal, fit.chi2)
    std = np.sqrt(np.diag(fit.covariance))
    scale = np.where(std > 0.0, std, 1.0)
    power, directions = np.linalg.eigh(extra / np.outer(scale, scale))
    root = scale[:, None] * directions * np.sqrt(np.maximum(power, 0.0))
    return np.asarray(root @ root.T)


def _compute_noise(normal: NormalEquations, step: JointStep) -> FloatArray:
    """Compute the covariance (p, p) of the unknowns by noise alone, of the corrected residual."""
    size = step.moves.size
    inverse = invert_information(normal.information)
    excess = step.excess[:size, :size]
    return np.asarray(step.chi2 * inverse + inverse @ excess @ inverse)
