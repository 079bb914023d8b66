# SPDX-License-Identifier: MIT
"""Correction of a fit for the effects that the model leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.budget import limit_evaluations
from drivetwin.estimation.likelihood.effects.columns import (
    EffectColumns,
    EffectPriors,
    build_columns,
)
from drivetwin.estimation.likelihood.effects.joint_step import (
    GroupEvidence,
    JointStep,
    compute_evidence,
    scale_by_evidence,
    select_one_mode,
    take_joint_step,
    weight_columns,
)
from drivetwin.estimation.likelihood.fit import (
    LikelihoodFit,
    compute_covariance,
    invert_information,
)
from drivetwin.estimation.optimize.objective import NormalEquations, ParameterVector
from drivetwin.estimation.result.cause import Group


@dataclass(frozen=True)
class CorrectionSettings:
    """Settings of the correction for effects."""

    linear_moves: float = 0.5
    """Largest move of an unknown, in its new standard deviations, up to which one step is taken:
    the error of a linear step is of second order in it."""
    shortest_step: float = 0.1
    """Share of the first step below which the second is not tried."""


CORRECTION = CorrectionSettings()


@dataclass(frozen=True, eq=False)
class Correction:
    """Fit corrected for effects.

    `mean` are the corrected unknowns with `covariance` (p, p) (total) and `noise` (p, p), that of
    noise alone. `step` is the last joint step; `second` (p,) the move of the unknowns between the
    first and the second, zero where one was enough. `evidence` is that of each group at the
    minimum of the fit.
    """

    mean: ParameterVector
    covariance: FloatArray
    noise: FloatArray
    step: JointStep
    second: FloatArray
    evidence: Mapping[Group, GroupEvidence]

    @property
    def joint_covariance(self) -> FloatArray:
        """Covariance (p+q, p+q) of unknowns and amounts of the effects."""
        joint = self.step.covariance
        size = self.mean.values.size
        joint[:size, :size] = self.covariance
        return joint

    @property
    def residuals(self) -> tuple[FloatArray, ...]:
        """Residuals (n,) of each shift with the effects taken out."""
        return self.step.residuals


def correct_fit(fit: LikelihoodFit, priors: EffectPriors) -> Correction | None:
    """Estimate the unknowns with all effects at their priors; None without a linear response.

    The first step is from the minimum of the fit. Where it leaves the range in which the columns
    are linear, they are formed anew where it ends, and a second step is taken from there.
    """
    columns = build_columns(fit.problem, fit.point, priors)
    if columns is None:
        return None
    sums = weight_columns(fit.problem, fit.normal, columns)
    evidence = compute_evidence(sums, fit.normal.information, fit.chi2)
    sums = select_one_mode(sums, evidence)
    sums = scale_by_evidence(sums, fit.normal.information, fit.chi2, evidence)
    step, normal, point = take_joint_step(fit.problem, fit.normal, sums), fit.normal, fit.point
    second = np.zeros_like(step.moves)
    size = second.size
    std = np.sqrt(np.diag(step.covariance)[:size])
    if np.max(np.abs(step.moves) / std) > CORRECTION.linear_moves:
        again = _take_second_step(fit, step, priors)
        if again is None:
            second = np.full_like(second, np.inf)
        else:
            first = step.moves
            step, normal, point = again.step, again.normal, again.point
            second = point.values + step.moves - fit.point.values - first
    extra = fit.covariance - compute_covariance(fit.problem, fit.normal, fit.chi2)
    values = fit.mean.values + point.values - fit.point.values + step.moves
    values = np.clip(values, fit.problem.lower, fit.problem.upper)
    return Correction(
        fit.mean.replace_values(values),
        step.covariance[:size, :size] + extra,
        _compute_noise(normal, step) + extra,
        step,
        second,
        evidence,
    )


def keep_fit(fit: LikelihoodFit) -> Correction:
    """Return a fit as it is, for one without a linear response: no effect is estimated."""
    size = fit.point.values.size
    none = EffectColumns((), (), (), np.empty(0), ())
    step = JointStep(
        columns=none,
        moves=np.zeros(size),
        amounts=np.empty(0),
        inverse=invert_information(fit.normal.information),
        excess=np.zeros((size, size)),
        chi2=max(fit.chi2, 1.0),
        residuals=fit.normal.residuals,
        contributions={},
    )
    return Correction(fit.mean, fit.covariance, fit.covariance, step, np.zeros(size), {})


@dataclass(frozen=True, eq=False)
class _SecondStep:
    """Joint step from `point`, the end of the first, with the expansion there."""

    step: JointStep
    normal: NormalEquations
    point: ParameterVector


def _take_second_step(
    fit: LikelihoodFit, first: JointStep, priors: EffectPriors
) -> _SecondStep | None:
    """Form the columns anew at the end of the first step, and step from there.

    The effects that act through inputs drive the run with the amounts of the first step, so they
    are no longer linear; the others stay columns. Where no run completes, the first step is halved.
    """
    share = 1.0
    with limit_evaluations(np.inf):
        while share > CORRECTION.shortest_step:
            values = fit.problem.retract(fit.point, share * first.moves)
            values = np.clip(values, fit.problem.lower, fit.problem.upper)
            found = _expand_with_inputs(fit, first, share, fit.point.replace_values(values), priors)
            if found is not None:
                return found
            share *= 0.5
    return None


def _expand_with_inputs(
    fit: LikelihoodFit, first: JointStep, share: float, point: ParameterVector, priors: EffectPriors
) -> _SecondStep | None:
    """Take the joint step from `point` with `share` of the first amounts in the inputs."""
    acting = share * first.amounts * first.columns.acts_on_inputs
    changes = first.columns.compute_inputs(acting)
    parts = [
        part.add_to_inputs(point, one) for part, one in zip(fit.problem.parts, changes, strict=True)
    ]
    problem = replace(fit.problem, parts=tuple(parts))
    normal = problem.normal(point)
    formed = first.columns.form_again(first.amounts)
    columns = None if normal is None else build_columns(problem, point, priors, formed)
    if normal is None or columns is None:
        return None
    columns = columns.follow(first.columns, acting)
    sums = weight_columns(problem, normal, columns)
    return _SecondStep(take_joint_step(problem, normal, sums), normal, point)


def _compute_noise(normal: NormalEquations, step: JointStep) -> FloatArray:
    """Compute the covariance (p, p) of the unknowns by noise alone, of the corrected residual."""
    size = step.moves.size
    inverse = invert_information(normal.information)
    excess = step.excess[:size, :size]
    return np.asarray(step.chi2 * inverse + inverse @ excess @ inverse)
