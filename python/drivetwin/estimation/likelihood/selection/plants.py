# SPDX-License-Identifier: MIT
"""Fits of plants with an element beside the dual clutch.

Where an effect changes the motion much, no column at the minimum of the dual clutch describes it:
a mode of the input side is absorbed by k_o before it shows. Such an effect is put into the plant
(`PLANTS`) and the fit repeated. Models are compared by their log evidence, and averaged.

With Q and the information F at the minima of both, and s the prior standard deviations of the
unknowns that the wider one adds, Laplace's log evidence for it is

    ln B = ½·(Q - Q′)/max(χ², 1) + ½·(log|F| - log|F′|) - Σ log s
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import log
from typing import Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.joint_step import SIZES
from drivetwin.estimation.likelihood.fit import LikelihoodFit, PlantEvidence
from drivetwin.estimation.likelihood.parametrization import PLANTS, DualClutchProblem, PlantEffect
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE
from drivetwin.likelihood.budget import MAX_REFIT_WORK, BudgetExceeded, limit_evaluations
from drivetwin.likelihood.covariance import compute_covariance
from drivetwin.likelihood.gauss_newton import OptimizeResult, minimise
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import NormalEquations, ParameterVector, Prior
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue

OWN_REACH = 3.0
"""Distance from their prior within which unknowns of an added element are sought, in its standard
deviations: a share of an inertia stays between 0 and 1 [-]."""


class Minimum(Protocol):
    """Minimum of Q: a fit, or the result of a search."""

    @property
    def point(self) -> ParameterVector:
        """Unknowns at the minimum."""

    @property
    def normal(self) -> NormalEquations:
        """Expansion of Q there."""


def compute_evidence(
    plain: Minimum, extended: Minimum, chi2: float, priors: Sequence[PriorValue]
) -> float:
    """Compute the log evidence of an extended model against a plain one.

    Q alone counts: both have the same weighting, or nearly. `chi2` is the residual power per
    sample, `priors` are those of the unknowns that the extended model adds.
    """
    fall = plain.normal.cost - extended.normal.cost
    before, after = (np.linalg.slogdet(one.normal.information)[1] for one in (plain, extended))
    spread = np.sum(np.log([one.std for one in priors]))
    return float(0.5 * fall / max(chi2, 1.0) + 0.5 * (before - after) - spread)


def average_over(fit: LikelihoodFit, others: Iterable[tuple[FloatArray, float]]) -> LikelihoodFit:
    """Widen the covariance of a fit by other models: `moves` (p,) of the unknowns to each, and its
    log odds.

    It grows by the outer products of the moves, times the probabilities of the models.
    """
    covariance = fit.covariance
    for moves, odds in others:
        covariance = covariance + np.exp(-np.logaddexp(0.0, -odds)) * np.outer(moves, moves)
    return replace(fit, covariance=covariance)


_LEAST_SPREAD = 1e-3
"""Least prior standard deviation of a size that is stated exactly, over the size [-]."""


def build_plant_priors(
    effect: EffectId, priors: EffectPriors, driveline: KnownDriveline, amount: float = 1.0
) -> tuple[PriorValue, ...]:
    """Build the priors of the unknowns of an added element.

    The logarithm of a size is about its stated value, else about its usual one. The spread of a
    signed size grows to the `amount` [prior standard deviations] that its columns show, as the
    prior of the amount does by the evidence.
    """
    row, prior = PLANTS[effect], priors.get_prior(effect, driveline)
    if row.signed:
        spread = max(prior.std * max(1.0, abs(amount)), _LEAST_SPREAD * abs(prior.value))
        return (PriorValue(prior.value, spread), *row.shape.values())
    return (_build_size_prior(prior, row.spread or SIZES.spread), *row.shape.values())


def _build_size_prior(prior: EffectPrior, spread: float) -> PriorValue:
    if not prior.value:
        return PriorValue(log(prior.std), spread)
    size = abs(prior.value)
    return PriorValue(log(size), max(prior.std / size, _LEAST_SPREAD))


def list_starts(effect: EffectId, prior: PriorValue) -> list[float]:
    """Return the initial values of the first unknown where no column shows one."""
    return [prior.value + start * prior.std for start in PLANTS[effect].starts]


def extend_problem(
    problem: DualClutchProblem,
    point: ParameterVector,
    effect: EffectId,
    priors: Sequence[PriorValue],
) -> tuple[DualClutchProblem, ParameterVector]:
    """Add an effect to the plant; its unknowns come last, at the means of their `priors`."""
    outputs = [out for term in problem.terms for out in term.record.outputs]
    full = max(float(np.max(np.abs(o.values))) for o in outputs if o.name == OUTPUT_TORQUE)
    own = PlantEffect(effect, full)
    values = np.append(point.values, [one.value for one in priors])
    extended = ParameterVector((*point.names, *own.unknowns), values)
    terms = [replace(one, plant=replace(one.plant, plant_effect=own)) for one in problem.terms]
    return problem.extend(terms, priors, OWN_REACH), extended


def drop_effect(problem: DualClutchProblem) -> DualClutchProblem:
    """Return the problem of the dual clutch alone, without unknowns of an added element."""
    effect = problem.terms[0].plant.plant_effect
    count = problem.lower.size - (0 if effect is None else len(effect.unknowns))
    prior = Prior(problem.prior.mean[:count], problem.prior.precision[:count, :count])
    terms = [replace(one, plant=replace(one.plant, plant_effect=None)) for one in problem.terms]
    lower, upper = problem.lower[:count], problem.upper[:count]
    return LikelihoodObjective(tuple(terms), prior, lower, upper)


def refit_plant(
    fit: LikelihoodFit,
    effect: EffectId,
    priors: Sequence[PriorValue],
    start: float,
) -> LikelihoodFit | None:
    """Fit with an effect in the plant, with the weighting of `fit`; None without a minimum.

    `start` is the first unknown of the element.
    """
    problem, point = extend_problem(fit.problem, fit.point, effect, priors)
    values, index = point.values.copy(), fit.point.values.size
    values[index] = start
    try:
        with limit_evaluations(MAX_REFIT_WORK):
            found = minimise(problem, point.replace_values(values))
    except BudgetExceeded:
        return None
    if found is None or not found.converged:
        return None
    return _build_fit(fit, found, compare_plants(fit, found, effect, fit.chi2, priors))


def compare_plants(
    plain: Minimum,
    extended: Minimum,
    effect: EffectId,
    chi2: float,
    priors: Sequence[PriorValue],
) -> PlantEvidence:
    """Compare the minimum of an extended plant with that of the dual clutch.

    `chi2` is the residual power per sample, `priors` are those of the unknowns of the element.
    """
    index = plain.point.values.size
    moves = extended.point.values[:index] - plain.point.values
    return PlantEvidence(
        effect,
        compute_evidence(plain, extended, chi2, priors),
        np.append(moves, np.zeros(len(priors))),
        index,
    )


def _build_fit(
    fit: LikelihoodFit, found: OptimizeResult[DualClutchProblem], plant: PlantEvidence
) -> LikelihoodFit:
    """Build the fit of an extended plant, with what models beside `fit` add to its covariance."""
    problem, point, normal = found.problem, found.point, found.normal
    chi2 = (normal.cost - problem.prior.compute_prior_cost(point.values)) / problem.size
    own, added = fit.covariance - fit.noise_covariance, point.values.size - plant.index
    return LikelihoodFit(
        problem,
        point,
        compute_covariance(problem, normal, chi2) + np.pad(own, (0, added)),
        normal,
        chi2,
        found.iterations,
        plant,
    )
