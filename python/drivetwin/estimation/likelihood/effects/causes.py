# SPDX-License-Identifier: MIT
"""Ranking of the causes that the log shows: evidence, equivalent causes, size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.likelihood.diagnostics.identifiability import locate_bounds
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.effect import Effect
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS, describe_group
from drivetwin.estimation.likelihood.effects.withdrawal import WITHDRAWAL, find_large_groups
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import LEAD, Cause, Group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.estimation.result.spread import EXPLAINED
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class CauseSettings:
    """Settings of the naming of causes."""

    equivalent: float = 0.9
    """Cosine between the fitted effects of two causes, the unknowns adjusted, from which the log
    cannot tell them apart."""
    largest_power: float = 1.2
    """Residual power per sample of the fit, a part of the plant included, above which no effect
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
    larger part would rest on the linear correction alone, to which many effects are alike. A size
    within its interval of zero is none, however much evidence the amounts of other effects lend
    it; a size beyond its prior, or at a bound of the search, is that of another cause.
    """
    if correction.step.chi2 > EXPLAINED or fit.chi2 > CAUSES.largest_power:
        return False
    value, std = size
    if std is not None and abs(value) <= Z95 * std:
        return False
    return not (group in find_large_groups(correction) or _is_part_implausible(fit, group.effect))


def _is_part_implausible(fit: LikelihoodFit, effect: EffectId | None) -> bool:
    """Return whether an unknown of the part of the plant is at a bound of the search, or where its
    prior excludes it."""
    if fit.plant is None or fit.plant.effect is not effect:
        return False
    own = slice(fit.plant.index, None)  # the unknowns of the part come last, its size first
    below, above = locate_bounds(fit)
    prior = fit.problem.prior
    apart = np.abs(fit.point.values - prior.mean)[own] * np.sqrt(np.diag(prior.precision))[own]
    return bool(np.any((below | above)[own] | (apart > WITHDRAWAL.sizes)))


def _compute_cosine(one: GroupEvidence, other: GroupEvidence) -> float:
    """Compute the cosine between the fitted effects of two groups in the weighted samples.

    A part of the plant has no columns; its own fit distinguishes it from all others.
    """
    if not (one.columns and other.columns):
        return 0.0
    product = float(one.answer[list(other.columns)] @ other.amounts)
    scale = np.sqrt(one.power * other.power)
    return float(abs(product) / scale) if scale > 0.0 else 0.0


def _estimate_size(
    effect: Effect, correction: Correction, group: Group
) -> tuple[float, float | None]:
    """Estimate the size of a cause with its standard deviation: beside all others, and of a part
    of the plant alone."""
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
