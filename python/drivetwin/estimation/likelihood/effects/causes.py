# SPDX-License-Identifier: MIT
"""Ranking of the causes that the log shows: evidence, equivalent causes, size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.effect import Effect
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS, describe_group
from drivetwin.estimation.result.cause import Cause, Group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec


@dataclass(frozen=True)
class CauseSettings:
    """Settings of the naming of causes."""

    least_evidence: float = 5.0
    """Log evidence beyond that of one cause among all from which it is named: odds of 150 to 1
    against chance, where each of N causes has the prior odds 1/N."""
    equivalent: float = 0.9
    """Cosine between the fitted effects of two causes, the unknowns adjusted, from which the log
    cannot tell them apart."""


CAUSES = CauseSettings()


def find_cause(correction: Correction) -> Cause | None:
    """Find the cause with most evidence; None if none has enough.

    Stated sensor tolerances are no candidates: they are expected to act.
    """
    ranked = sorted(
        ((group, one) for group, one in correction.evidence.items() if group.effect is not None),
        key=lambda pair: -pair[1].nats,
    )
    if not ranked or ranked[0][1].nats < CAUSES.least_evidence + np.log(len(ranked)):
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
    )


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
        effect=" or ".join(describe_group(one) for one in (cause.group, *cause.equivalent)),
        size=_format_size(cause, EFFECTS[effect].unit),
        evidence=cause.evidence,
        changes=", ".join(changes) or "no value by more than its interval",
        advice=_capitalise(EFFECTS[effect].remedy),
    )


def _select_code(cause: Cause) -> Code:
    if cause.in_plant:
        return Code.EFFECT_IN_PLANT
    return Code.EFFECT_FOUND if cause.is_certain else Code.EFFECT_POSSIBLE


def _capitalise(text: str) -> str:
    """Write the first letter of a sentence as a capital."""
    return text[:1].upper() + text[1:]


def _format_size(cause: Cause, unit: str) -> str:
    """Format the size of a cause in its unit."""
    if cause.std is None:
        return f"{cause.size:.2g} times its usual size"
    return f"{cause.size:.2g} ± {Z95 * cause.std:.1g} {unit}".removesuffix(" 1")
