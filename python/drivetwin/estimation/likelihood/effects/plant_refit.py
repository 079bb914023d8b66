# SPDX-License-Identifier: MIT
"""Choice of the plant: the dual clutch, or one with a part beside it.

Where an effect changes the motion much, no column at the minimum of the dual clutch describes it:
a mode of the input side is absorbed by k_o before it shows. Such an effect is put into the plant
and the fit repeated. With F the information of the unknowns at each minimum of Q, and s the prior
standard deviation of the logarithm of the size, Laplace's evidence for it is

    ln B = ½·(Q - Q′)/max(χ², 1) + ½·(log|F| - log|F′|) - log s
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.likelihood.budget import BudgetExceeded, limit_evaluations
from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.joint_step import SIZES, GroupEvidence
from drivetwin.estimation.likelihood.extension import Extension
from drivetwin.estimation.likelihood.fit import (
    LikelihoodFit,
    PlantEvidence,
    compute_covariance,
)
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.optimize.gauss_newton import OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import NormalEquations, ParameterVector
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class PlantSettings:
    """Settings of the choice of the plant."""

    evidence: float = 5.0
    """Log evidence from which a plant is chosen: odds of 150, as for a cause that is named [-]."""
    max_work: float = 600.0
    """Work of one refit: it takes 3 to 6 expansions of about 30 passes [passes]."""
    mode_spread: float = 0.5
    """Prior standard deviation of the logarithm of a mode's frequency: 0.4 to 2.7 times the usual
    one hold 95 % [-]."""

    least_spread: float = 1e-3
    """Least prior standard deviation of the logarithm of a size that is stated exactly [-]."""


PLANT = PlantSettings()
BY_EVIDENCE = (EffectId.BACKLASH,)
"""Effects that are tried in the plant where their columns show them."""


def select_plant(fit: LikelihoodFit, priors: EffectPriors) -> LikelihoodFit:
    """Choose the plant that the log supports; `fit` is that of the dual clutch.

    A part is kept where the card states its size, or where its evidence is enough and no other
    effect has more. Otherwise the
    covariance grows by the move that the part would cause, times its odds.
    """
    if not fit.problem.parts[0].scale_known or fit.plant is not None:
        return fit
    expansion = expand_effects(fit, priors)
    if expansion is None:
        return fit
    evidence = expansion.evidence
    refits = list(_iterate_refits(fit, evidence, priors))
    best = max(refits, key=get_nats, default=None)
    if best is None or best.plant is None:
        return fit
    own = best.plant.effect
    stated = priors.get_prior(own, fit.problem.parts[0].structure.driveline).value
    rivals = [one.nats for group, one in evidence.items() if group.effect not in (None, own)]
    most = max([0.0, *rivals])
    if stated or best.plant.nats > max(PLANT.evidence, most):
        return best
    return _widen(fit, [one for one in refits if one.plant is not None], most)


def get_nats(fit: LikelihoodFit) -> float:
    """Return the log evidence of the plant of a fit against the dual clutch; 0 for that one."""
    return 0.0 if fit.plant is None else fit.plant.nats


def _iterate_refits(
    fit: LikelihoodFit, evidence: Mapping[Group, GroupEvidence], priors: EffectPriors
) -> Iterator[LikelihoodFit]:
    """Yield the refits that end at a minimum.

    The mode of the input side has no columns and is always tried, an effect of `BY_EVIDENCE` where
    its columns have enough evidence.
    """
    driveline = fit.problem.parts[0].structure.driveline
    tried = {EffectId.INPUT_SHAFT_MODE: None} | {
        effect: float(abs(found.amounts[0]))
        for effect in BY_EVIDENCE
        if (found := evidence.get(Group(effect))) is not None and found.nats > PLANT.evidence
    }
    for effect, amount in tried.items():
        stated = priors.get_prior(effect, driveline)
        if stated.std > 0.0 or stated.value:
            prior = build_size_prior(effect, priors, driveline)
            start = prior.value + (0.0 if amount is None else float(np.log(amount)))
            refit = _refit(fit, effect, prior, start)
            if refit is not None:
                yield refit


def build_size_prior(
    effect: EffectId, priors: EffectPriors, driveline: KnownDriveline
) -> PriorValue:
    """Build the prior of the logarithm of a size: about its stated value, else about its usual
    one."""
    prior = priors.get_prior(effect, driveline)
    if prior.value:
        size = abs(prior.value)
        return PriorValue(float(np.log(size)), max(prior.std / size, PLANT.least_spread))
    spread = PLANT.mode_spread if effect is EffectId.INPUT_SHAFT_MODE else SIZES.spread
    return PriorValue(float(np.log(prior.std)), spread)


def extend_problem(
    problem: LikelihoodObjective, point: ParameterVector, effect: EffectId, prior: PriorValue
) -> tuple[LikelihoodObjective, ParameterVector]:
    """Add an effect to the plant; the point has the logarithm of its size as the last unknown."""
    outputs = [out for part in problem.parts for out in part.record.outputs]
    full = max(float(np.max(np.abs(o.values))) for o in outputs if o.name == OUTPUT_TORQUE)
    extension = Extension(effect, full)
    values = np.append(point.values, prior.value)
    extended = ParameterVector((*point.names, extension.unknown), values)
    return problem.extend(extension, prior), extended


def _refit(
    fit: LikelihoodFit, effect: EffectId, prior: PriorValue, start: float
) -> LikelihoodFit | None:
    """Fit with an effect in the plant, with the weighting of `fit`; None without a minimum."""
    problem, point = extend_problem(fit.problem, fit.point, effect, prior)
    values = np.append(fit.point.values, start)
    try:
        with limit_evaluations(PLANT.max_work):
            found = minimise(problem, point.replace_values(values))
    except BudgetExceeded:
        return None
    if found is None or not found.converged:
        return None
    nats = compare_plants(fit.normal, found.normal, fit.chi2, prior)
    return _build_fit(fit, found, PlantEvidence(effect, nats, _compute_moves(fit, found.point)))


def _compute_moves(fit: LikelihoodFit, point: ParameterVector) -> FloatArray:
    """Compute the moves (p,) of the unknowns by the part; none of its own size."""
    return np.append(point.values[:-1] - fit.point.values, 0.0)


def compare_plants(
    plain: NormalEquations, extended: NormalEquations, chi2: float, prior: PriorValue
) -> float:
    """Compute the log evidence of an extended plant against the dual clutch.

    Both expansions have the same weighting, so Q alone counts.
    """
    fall = plain.cost - extended.cost
    volume = _compute_log_determinant(plain) - _compute_log_determinant(extended)
    return 0.5 * fall / max(chi2, 1.0) + 0.5 * volume - float(np.log(prior.std))


def _compute_log_determinant(normal: NormalEquations) -> float:
    return float(np.linalg.slogdet(normal.information)[1])


def _build_fit(
    fit: LikelihoodFit, found: OptimizeResult[LikelihoodObjective], plant: PlantEvidence
) -> LikelihoodFit:
    """Build the fit of an extended plant; it has the average over sampling modes of `fit`."""
    problem, point, normal = found.problem, found.point, found.normal
    chi2 = (normal.cost - problem.prior.compute_prior_cost(point.values)) / problem.size
    own = fit.covariance - fit.noise_covariance
    values = point.values + np.append(fit.mean.values - fit.point.values, 0.0)
    return LikelihoodFit(
        problem,
        point,
        point.replace_values(np.clip(values, problem.lower, problem.upper)),
        compute_covariance(problem, normal, chi2) + np.pad(own, (0, 1)),
        normal,
        chi2,
        found.iterations,
        plant,
    )


def _widen(fit: LikelihoodFit, refits: list[LikelihoodFit], most: float) -> LikelihoodFit:
    """Widen the covariance by the moves to refits whose effect no column describes.

    The weight is the probability of the part beside the dual clutch and the effect with the `most`
    evidence.
    """
    covariance = fit.covariance
    for one in refits:
        if one.plant is None or one.plant.effect in BY_EVIDENCE:
            continue
        against = np.logaddexp(0.0, most)
        weight = float(np.exp(-np.logaddexp(0.0, against - one.plant.nats)))
        far = one.plant.moves[:-1]
        covariance = covariance + weight * np.outer(far, far)
    return replace(fit, covariance=covariance)
