# SPDX-License-Identifier: MIT
"""Ranking of the causes that the log shows: evidence, equivalent causes, size.

Spread of the values over causes between which the log does not decide.

Withdrawal of the verdict `identified` where the correction for effects is unreliable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.effect import Effect
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS, describe_group
from drivetwin.estimation.likelihood.fit import LikelihoodFit, locate_bounds
from drivetwin.estimation.result.cause import EXPLAINED, LEAD, Cause, Group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class WithdrawalSettings:
    """Limits beyond which a corrected value does not count as identified."""

    sizes: float = 3.0
    """Amount of an effect in stated prior standard deviations beyond which the prior is refuted,
    so that the interval of what the effect moves is too."""
    moves: float = 1.0
    """Move of a value by such an effect, in its standard deviations, that makes it unreliable."""
    last_step: float = 1.5
    """Move of a value by the last step, in its standard deviations, from which the effects are
    not linear: one more step would move it again."""
    chi2: float = EXPLAINED
    """Residual power per sample after the correction above which something is missing from the
    model that no effect describes."""


WITHDRAWAL = WithdrawalSettings()
EXEMPT = (EffectId.FRICTION_SHAPE, None)
"""Effects whose amounts may be large: shapes have no usual size, tolerances are the card's."""


def find_unreliable(
    correction: Correction,
    ids: Sequence[str],
    jacobian: FloatArray,
    std: FloatArray,
    *,
    is_noise: bool,
) -> list[Finding]:
    """Find the values that the correction does not make reliable, each with the reason as an error.

    Parameters
    ----------
    ids : parameter ids (k,) of the values
    jacobian : derivatives (k, p) of the values by the unknowns of the fit
    std : total standard deviations (k,) of the values
    is_noise : whether the residual is as white as noise; more power of it is in the intervals
    """
    chi2 = correction.step.chi2
    if chi2 > WITHDRAWAL.chi2 and not is_noise:
        return [report(Code.RESIDUAL_UNEXPLAINED, chi2=chi2)]
    if not np.all(np.isfinite(correction.last)):
        return [report(Code.EFFECT_NOT_LINEAR, name) for name in ids]
    last = np.abs(jacobian @ correction.last)
    found = [
        report(Code.EFFECT_NOT_LINEAR, ids[int(k)])
        for k in np.flatnonzero(last > WITHDRAWAL.last_step * std)
    ]
    for group in find_large_groups(correction):
        moves = np.abs(jacobian @ correction.step.contributions[group])
        found += [
            report(Code.EFFECT_LARGE, ids[int(k)], effect=describe_group(group))
            for k in np.flatnonzero(moves > WITHDRAWAL.moves * std)
        ]
    return found


def compute_doubt(correction: Correction, jacobian: FloatArray) -> FloatArray:
    """Compute how far (k,) each value has been moved by what makes it unreliable.

    That is the last step, and the moves by groups beyond their priors. The interval of a value
    that is withdrawn reaches back over them.
    """
    moves = [np.nan_to_num(correction.last, posinf=0.0)]
    moves += [correction.step.contributions[one] for one in find_large_groups(correction)]
    return np.asarray(np.linalg.norm([jacobian @ one for one in moves], axis=0))


def find_large_groups(correction: Correction) -> list[Group]:
    """Return the groups whose amounts refute their priors."""
    step = correction.step
    sizes = np.abs(step.amounts) * step.columns.scale
    large = [g for g, one in zip(step.columns.groups, sizes, strict=True) if one > WITHDRAWAL.sizes]
    return [one for one in dict.fromkeys(large) if one.effect not in EXEMPT]


@dataclass(frozen=True)
class CauseSettings:
    """Settings of the naming of causes."""

    equivalent: float = 0.9
    """Cosine between the fitted effects of two causes, the unknowns adjusted, from which the log
    cannot tell them apart."""
    largest_power: float = 1.2
    """Residual power per sample of the fit, an added element included, above which no effect
    that is only a linear correction counts as certain: it would explain more than a fifth of the
    noise."""


CAUSES = CauseSettings()


def find_cause(correction: Correction, fit: LikelihoodFit) -> Cause | None:
    """Find the cause with most evidence; None if it has less than `LEAD` among N causes, each with
    the prior odds 1/N.

    Stated sensor tolerances are no candidates: they are expected to act. The cause explains the log
    only if `fit` and its correction do, and its size is plausible.
    """
    ranked = sorted(
        ((group, one) for group, one in correction.evidence.items() if group.effect is not None),
        key=lambda pair: -pair[1].nats,
    )
    if not ranked or ranked[0][1].nats < LEAD + np.log(len(ranked)):
        return None
    group, best = ranked[0]
    similar = {other for other, one in ranked[1:] if _compute_cosine(best, one) > CAUSES.equivalent}
    named = [one for one in similar if correction.evidence[one].nats > 0.0]
    rest = [one.nats for other, one in ranked[1:] if other not in similar]
    assert group.effect is not None, "tolerances of sensors are no candidates"
    effect = EFFECTS[group.effect]
    size, std = _estimate_size(effect, correction, group)
    return Cause(
        group,
        best.nats,
        size,
        std,
        tuple(one for one, _ in ranked if one in named),
        max(rest, default=0.0),
        in_plant=not best.columns,
        is_explained=_is_explained(correction, fit, group, (size, std)),
    )


def _is_explained(
    correction: Correction, fit: LikelihoodFit, group: Group, size: tuple[float, float | None]
) -> bool:
    """Return whether a cause explains the log by a plausible `size` with its standard deviation.

    The residual with it is at the level of noise, and so is that of the fit but for a fifth: a
    larger share would rest on the linear correction alone, to which many effects are alike. A size
    within its interval of zero is none, however much evidence the amounts of other effects lend
    it; a size beyond its prior, or at a bound of the search, is that of another cause.
    """
    if correction.step.chi2 > EXPLAINED or fit.chi2 > CAUSES.largest_power:
        return False
    value, std = size
    if std is not None and abs(value) <= Z95 * std:
        return False
    return not (group in find_large_groups(correction) or _is_plant_implausible(fit, group.effect))


def _is_plant_implausible(fit: LikelihoodFit, effect: EffectId | None) -> bool:
    """Return whether an unknown of the added element is at a bound of the search, or where its
    prior excludes it."""
    if fit.plant is None or fit.plant.effect is not effect:
        return False
    own = slice(
        fit.plant.index, None
    )  # the unknowns of the added element come last, its size first
    below, above = locate_bounds(fit)
    prior = fit.problem.prior
    apart = np.abs(fit.point.values - prior.mean)[own] * np.sqrt(np.diag(prior.precision))[own]
    return bool(np.any((below | above)[own] | (apart > WITHDRAWAL.sizes)))


def _compute_cosine(one: GroupEvidence, other: GroupEvidence) -> float:
    """Compute the cosine between the fitted effects of two groups in the weighted samples.

    An added element has no columns; its own fit distinguishes it from all others.
    """
    if not (one.columns and other.columns):
        return 0.0
    product = float(one.answer[list(other.columns)] @ other.amounts)
    scale = np.sqrt(one.power * other.power)
    return float(abs(product) / scale) if scale > 0.0 else 0.0


def _estimate_size(
    effect: Effect, correction: Correction, group: Group
) -> tuple[float, float | None]:
    """Estimate the size of a cause with its standard deviation: beside all others; of an
    added element alone."""
    step, columns = correction.step, correction.step.columns.find_columns(group)
    if not columns:
        own = correction.evidence[group]
        return float(own.amounts[0]), float(own.std[0])
    amounts = step.amounts[columns] * step.columns.scale[columns]
    if effect.random or len(columns) > 1:
        return float(np.sqrt(np.mean(amounts**2))), None
    unit, amount = step.columns.stds.get(group, 1.0), float(amounts[0])
    size = effect.scale_amount(amount, unit)
    spread = float(step.std[columns[0]] * step.columns.scale[columns[0]])
    slope = abs(size / amount) / effect.power if amount else unit
    return size, spread * slope


def report_cause(
    cause: Cause,
    correction: Correction,
    values: Mapping[str, float],
    jacobian: FloatArray,
    std: FloatArray,
) -> Finding:
    """Report the cause that the log shows: how large it is, what it moves, what to do.

    `values` are the parameters by id, `jacobian` (k, p) their derivatives by the unknowns, `std`
    (k,) their total standard deviations.
    """
    effect = cause.group.effect
    assert effect is not None, "tolerances of sensors are no candidates"
    own = correction.evidence[cause.group].moves
    moves = jacobian @ correction.step.contributions.get(cause.group, own)[: jacobian.shape[1]]
    changes = [
        f"{name} by {format_with_unit(float(move), get_parameter_spec(name).unit, digits=2)}"
        for name, move, one in zip(values, moves, std, strict=True)
        if abs(move) > one
    ]
    return report(
        _select_code(cause),
        effect=describe_cause(cause),
        size=_format_size(cause, EFFECTS[effect]),
        evidence=cause.evidence,
        changes=", ".join(changes) or "no value by more than its interval",
        advice=get_advice(cause),
    )


def _select_code(cause: Cause) -> Code:
    if not cause.is_explained:
        return Code.EFFECT_RESEMBLED
    if cause.in_plant:
        return Code.EFFECT_IN_PLANT
    return Code.EFFECT_FOUND if cause.is_certain else Code.EFFECT_POSSIBLE


def _capitalise(text: str) -> str:
    """Write the first letter of a sentence as a capital."""
    return text[:1].upper() + text[1:]


def describe_cause(cause: Cause) -> str:
    """Describe a cause and those that the log cannot tell from it."""
    return " or ".join(describe_group(one) for one in (cause.group, *cause.equivalent))


def _format_size(cause: Cause, effect: Effect) -> str:
    """Format the size of a cause in its unit, with the meaning of a negative one."""
    if cause.std is None:
        return f"{cause.size:.2g} times its usual size"
    half = Z95 * cause.std
    size = f"{cause.size:.2g} ± {half:.1g} {effect.unit}".removesuffix(" 1")
    if effect.unit == "s":
        size = format_with_unit(cause.size, effect.unit, half)
    return f"{size}, {effect.negative}" if effect.negative and cause.size < -half else size


def get_advice(cause: Cause) -> str:
    """Return what to do about a cause, as a sentence without its period."""
    assert cause.group.effect is not None, "tolerances of sensors are no candidates"
    return _capitalise(EFFECTS[cause.group.effect].remedy)


def widen_by_rivals(correction: Correction, fit: LikelihoodFit, cause: Cause | None) -> Correction:
    """Widen a correction by what the values would be if a single one of the near causes acted.

    The joint step divides a mismatch between all effects by their priors. Where several causes
    explain the log as well, one alone may be true, and then the values move as that one moves them.
    With weights w by evidence and d the moves by one cause alone less the moves of the joint step,
    the covariance grows by Σ w·d·dᵀ. Nothing changes where one cause leads.
    """
    if cause is None or cause.is_alone or cause.in_plant:
        return correction
    near = [
        one
        for group, one in correction.evidence.items()
        if group.effect is not None and one.columns and cause.evidence - one.nats < LEAD
    ]
    weights = np.exp([one.nats - cause.evidence for one in near])
    applied = correction.mean.values - fit.point.values
    apart = np.array([one.moves[: applied.size] - applied for one in near])
    extra = (apart.T * (weights / weights.sum())) @ apart
    return replace(correction, covariance=correction.covariance + extra)
