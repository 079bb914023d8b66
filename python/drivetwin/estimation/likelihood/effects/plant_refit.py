# SPDX-License-Identifier: MIT
"""Choice of the plant: the dual clutch, or one with a part beside it.

Where an effect changes the motion much, no column at the minimum of the dual clutch describes it:
a mode of the input side is absorbed by k_o before it shows. Such an effect is put into the plant
and the fit repeated. With F the information of the unknowns at each minimum of Q, and s the prior
standard deviations of the unknowns of the part, Laplace's evidence for it is

    ln B = ½·(Q - Q′)/max(χ², 1) + ½·(log|F| - log|F′|) - Σ log s
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Protocol

import numpy as np

from drivetwin._util.timed_stages import TimedStages
from drivetwin.estimation.data.shift_data import KnownDriveline
from drivetwin.estimation.likelihood.budget import BudgetExceeded, limit_evaluations
from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import SHOWN, expand_effects
from drivetwin.estimation.likelihood.effects.joint_step import SIZES, GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import (
    LikelihoodFit,
    PlantEvidence,
    compute_covariance,
)
from drivetwin.estimation.likelihood.plant_effect import (
    AMOUNT,
    DAMPING,
    SHARE,
    SIZE,
    UNKNOWNS,
    PlantEffect,
)
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.optimize.gauss_newton import OptimizeResult, minimise
from drivetwin.estimation.optimize.objective import NormalEquations, ParameterVector
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class PlantSettings:
    """Settings of the choice of the plant."""

    evidence: float = 5.0
    """Log evidence from which a plant is chosen: odds of 150, as for a cause that is named [-]."""
    max_work: float = 600.0
    """Work of one refit: it takes 3 to 6 expansions of about 30 passes [passes]."""
    starts: tuple[float, ...] = (-1.0, 0.0)
    """Initial values of the logarithm of a mode's frequency, in standard deviations from its prior
    mean. Q has several minima; a low mode is not found from a usual one, and a high one moves
    little [-]."""
    mode_spread: float = 0.5
    """Prior standard deviation of the logarithm of a mode's frequency: 0.4 to 2.7 times the usual
    one hold 95 % [-]."""
    share: float = 0.5
    """Usual share of J1 in front of an input shaft: flywheel and crankshaft against pump, converter
    or primary masses [-]."""
    share_std: float = 0.12
    """Prior standard deviation of that share [-]."""
    damping: float = 0.05
    """Usual damping ratio of the mode [-]."""
    damping_spread: float = 0.5
    """Prior standard deviation of its logarithm: 2 to 13 % hold 95 % [-]."""
    least_spread: float = 1e-3
    """Least prior standard deviation of a size that is stated exactly, over the size [-]."""


PLANT = PlantSettings()
_STAGES = TimedStages("plant", ("expansion", "first refit", "refit"))


class Minimum(Protocol):
    """Minimum of Q: a fit, or the result of a search."""

    @property
    def problem(self) -> ShiftObjective:
        """Problem that was minimised."""

    @property
    def point(self) -> ParameterVector:
        """Unknowns at the minimum."""

    @property
    def normal(self) -> NormalEquations:
        """Expansion of Q there."""


def select_plant(fit: LikelihoodFit, priors: EffectPriors) -> LikelihoodFit:
    """Choose the plant that the log supports; `fit` is that of the dual clutch.

    A part is kept where the card states its size, or where its evidence is enough, no other effect
    has more, and its own columns at the minimum of the dual clutch have clearly less: where they
    describe it as well, they move the values as the plant would. Otherwise the covariance grows by
    the move that the part would cause, times its probability.
    """
    if not fit.problem.parts[0].scale_known or fit.plant is not None:
        return fit
    with _STAGES.enter("expansion"):
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
    columns = [one.nats for group, one in evidence.items() if group.effect is own]
    most = max([0.0, *rivals])
    if stated or best.plant.nats > max(PLANT.evidence, most, SHOWN + max(columns, default=0.0)):
        return best
    shown = most if most > SHOWN else 0.0
    return _widen(fit, [one for one in refits if one.plant is not None], shown)


def get_nats(fit: LikelihoodFit) -> float:
    """Return the log evidence of the plant of a fit against the dual clutch; 0 for that one."""
    return 0.0 if fit.plant is None else fit.plant.nats


def _iterate_refits(
    fit: LikelihoodFit, evidence: Mapping[Group, GroupEvidence], priors: EffectPriors
) -> Iterator[LikelihoodFit]:
    """Yield the refits that end at a minimum, one for each effect.

    An effect is tried where its columns have enough evidence, or where none of its columns could
    show it.
    """
    driveline = fit.problem.parts[0].structure.driveline
    plans: list[tuple[EffectId, tuple[PriorValue, ...], list[float]]] = []
    for effect in UNKNOWNS:
        stated = priors.get_prior(effect, driveline)
        if not (stated.std > 0.0 or stated.value):
            continue
        if not EFFECTS[effect].has_columns:
            own = build_plant_priors(effect, priors, driveline)
            plans.append((effect, own, _list_starts(own[0])))
            continue
        amount = _find_amount(effect, evidence)
        if amount:
            own = build_plant_priors(effect, priors, driveline, amount)
            size = amount * stated.std
            start = size if UNKNOWNS[effect][0] == AMOUNT else float(np.log(abs(size)))
            plans.append((effect, own, [start]))
    stages, numbers = _STAGES.repeat("refit", sum(len(one[2]) for one in plans) - 1), count()
    for effect, own, starts in plans:
        refits = []
        for start in starts:
            number = next(numbers)
            name = "refit" if number else "first refit"  # that from a low frequency takes longest
            with stages.enter(name, number=max(number - 1, 0)):
                refits.append(_refit(fit, effect, own, start))
        yield from sorted((one for one in refits if one), key=get_nats)[-1:]


def _find_amount(effect: EffectId, evidence: Mapping[Group, GroupEvidence]) -> float:
    """Return the amount of an effect, in prior standard deviations, by its likeliest column; 0
    where its columns have too little evidence."""
    groups = [one for group, one in evidence.items() if group.effect is effect]
    best = max(groups, key=lambda one: one.nats, default=None)
    return float(best.amounts[0]) if best and best.nats > PLANT.evidence else 0.0


def _list_starts(prior: PriorValue) -> list[float]:
    """Return the initial values of the logarithm of a mode's frequency."""
    return [prior.value + start * prior.std for start in PLANT.starts]


def build_plant_priors(
    effect: EffectId, priors: EffectPriors, driveline: KnownDriveline, amount: float = 1.0
) -> tuple[PriorValue, ...]:
    """Build the priors of the unknowns of a part.

    The logarithm of a size is about its stated value, else about its usual one. The spread of a
    signed size grows to the `amount` [prior standard deviations] that its columns show, as the
    prior of the amount does by the evidence.
    """
    prior = priors.get_prior(effect, driveline)
    own = {SIZE: _build_size_prior(effect, prior)}
    spread = max(prior.std * max(1.0, abs(amount)), PLANT.least_spread * abs(prior.value))
    own[AMOUNT] = PriorValue(prior.value, spread)
    own[SHARE] = PriorValue(PLANT.share, PLANT.share_std)
    own[DAMPING] = PriorValue(float(np.log(PLANT.damping)), PLANT.damping_spread)
    return tuple(own[key] for key in UNKNOWNS[effect])


def _build_size_prior(effect: EffectId, prior: EffectPrior) -> PriorValue:
    if prior.value:
        size = abs(prior.value)
        return PriorValue(float(np.log(size)), max(prior.std / size, PLANT.least_spread))
    spread = PLANT.mode_spread if effect is EffectId.INPUT_SHAFT_MODE else SIZES.spread
    return PriorValue(float(np.log(prior.std)), spread)


def extend_problem(
    problem: ShiftObjective,
    point: ParameterVector,
    effect: EffectId,
    priors: Sequence[PriorValue],
) -> tuple[ShiftObjective, ParameterVector]:
    """Add an effect to the plant; its unknowns come last, at the means of their `priors`."""
    outputs = [out for part in problem.parts for out in part.record.outputs]
    full = max(float(np.max(np.abs(o.values))) for o in outputs if o.name == OUTPUT_TORQUE)
    own = PlantEffect(effect, full)
    values = np.append(point.values, [one.value for one in priors])
    extended = ParameterVector((*point.names, *own.unknowns), values)
    return problem.extend(own, priors), extended


def _refit(
    fit: LikelihoodFit, effect: EffectId, priors: Sequence[PriorValue], start: float
) -> LikelihoodFit | None:
    """Fit with an effect in the plant, with the weighting of `fit`; None without a minimum.

    `start` is the first unknown of the part.
    """
    problem, point = extend_problem(fit.problem, fit.point, effect, priors)
    values, index = point.values.copy(), fit.point.values.size
    values[index] = start
    try:
        with limit_evaluations(PLANT.max_work):
            found = minimise(problem, point.replace_values(values))
    except BudgetExceeded:
        return None
    if found is None or not found.converged:
        return None
    return _build_fit(fit, found, compare_plants(fit, found, fit.chi2, priors))


def compare_plants(
    plain: Minimum, extended: Minimum, chi2: float, priors: Sequence[PriorValue]
) -> PlantEvidence:
    """Compare the minimum of an extended plant with that of the dual clutch.

    Both have the same weighting, so Q alone counts. `chi2` is the residual power per sample,
    `priors` are those of the unknowns of the part.
    """
    own = extended.problem.parts[0].structure.plant_effect
    assert own is not None, "the plant has an effect"
    fall = plain.normal.cost - extended.normal.cost
    volume = _compute_log_determinant(plain.normal) - _compute_log_determinant(extended.normal)
    spread = float(np.sum(np.log([one.std for one in priors])))
    index = plain.point.values.size
    moves = extended.point.values[:index] - plain.point.values
    return PlantEvidence(
        own.effect,
        0.5 * fall / max(chi2, 1.0) + 0.5 * volume - spread,
        np.append(moves, np.zeros(len(priors))),
        index,
    )


def _compute_log_determinant(normal: NormalEquations) -> float:
    return float(np.linalg.slogdet(normal.information)[1])


def _build_fit(
    fit: LikelihoodFit, found: OptimizeResult[ShiftObjective], plant: PlantEvidence
) -> LikelihoodFit:
    """Build the fit of an extended plant; it has the average over sampling modes of `fit`."""
    problem, point, normal = found.problem, found.point, found.normal
    chi2 = (normal.cost - problem.prior.compute_prior_cost(point.values)) / problem.size
    own, added = fit.covariance - fit.noise_covariance, point.values.size - plant.index
    values = point.values + np.append(fit.mean.values - fit.point.values, np.zeros(added))
    return LikelihoodFit(
        problem,
        point,
        point.replace_values(np.clip(values, problem.lower, problem.upper)),
        compute_covariance(problem, normal, chi2) + np.pad(own, (0, added)),
        normal,
        chi2,
        found.iterations,
        plant,
    )


def _widen(fit: LikelihoodFit, refits: list[LikelihoodFit], shown: float) -> LikelihoodFit:
    """Widen the covariance by the moves to refits whose effect no column describes.

    The weight is the probability of the part against the dual clutch alone, and against the effect
    with most evidence where the log shows one: a part may stand in for that effect. `shown` is its
    evidence, 0 without one.
    """
    covariance = fit.covariance
    for one in refits:
        if one.plant is None or EFFECTS[one.plant.effect].has_columns:
            continue
        against = np.logaddexp(0.0, shown) if shown else 0.0
        weight = float(np.exp(-np.logaddexp(0.0, against - one.plant.nats)))
        far = one.plant.moves[: one.plant.index]
        covariance = covariance + weight * np.outer(far, far)
    return replace(fit, covariance=covariance)
