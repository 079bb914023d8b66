# SPDX-License-Identifier: MIT
"""Ranking of the causes that the log shows: evidence, equivalent causes, size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.effect import Group
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.effects.table import EFFECTS, describe_group
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class CauseSettings:
    """Settings of the naming of causes."""

    least_evidence: float = 5.0
    """Log evidence from which a cause is named: odds of 150 to 1 against chance."""
    lead: float = 5.0
    """Lead of log evidence over the next cause from which it counts as found."""
    equivalent: float = 0.9
    """Cosine between the fitted effects of two causes, the unknowns adjusted, from which the log
    cannot tell them apart."""


CAUSES = CauseSettings()


@dataclass(frozen=True)
class Cause:
    """Cause that the log shows.

    `evidence` is the log evidence against its absence, `size` its estimate alone in the unit of
    the effect with `std`; for a random effect `size` is its root mean square in stated sizes and
    `std` None. `equivalent` are causes that the log cannot tell from it, `next_evidence` that of
    the best other one. `is_certain` is False where another cause comes near.
    """

    group: Group
    evidence: float
    size: float
    std: float | None
    equivalent: tuple[Group, ...]
    next_evidence: float

    @property
    def is_certain(self) -> bool:
        """True if no other cause comes near in evidence."""
        return self.evidence - self.next_evidence >= CAUSES.lead


def find_cause(correction: Correction, priors: EffectPriors) -> Cause | None:
    """Find the cause with most evidence; None if none has enough.

    Stated sensor tolerances are no candidates: they are expected to act.
    """
    ranked = sorted(
        (
            (group, one)
            for group, one in correction.evidence.items()
            if group.effect is not EffectId.SENSOR_TOLERANCE
        ),
        key=lambda pair: -pair[1].nats,
    )
    if not ranked or ranked[0][1].nats < CAUSES.least_evidence:
        return None
    group, best = ranked[0]
    similar = {
        other
        for other, one in ranked[1:]
        if _compute_cosine(best, one) > CAUSES.equivalent or _is_same_kind(group, other)
    }
    named = [one for one in similar if correction.evidence[one].nats > 0.0]
    rest = [one.nats for other, one in ranked[1:] if other not in similar]
    size, std = _estimate_size(priors, group, best)
    return Cause(
        group,
        best.nats,
        size,
        std,
        tuple(one for one, _ in ranked if one in named and not _is_same_kind(group, one)),
        max(rest, default=0.0),
    )


def _is_same_kind(one: Group, other: Group) -> bool:
    """Return whether two groups are one effect at neighbouring frequencies."""
    return one.effect is other.effect is EffectId.INPUT_SHAFT_MODE


def _compute_cosine(one: GroupEvidence, other: GroupEvidence) -> float:
    """Compute the cosine between the fitted effects of two groups in the weighted samples."""
    product = float(one.answer[list(other.columns)] @ other.amounts)
    scale = np.sqrt(one.power * other.power)
    return float(abs(product) / scale) if scale > 0.0 else 0.0


def _estimate_size(
    priors: EffectPriors, group: Group, one: GroupEvidence
) -> tuple[float, float | None]:
    """Estimate the size of a cause alone, in its unit, with its standard deviation."""
    effect = EFFECTS[group.effect]
    if effect.random or one.amounts.size > 1:
        return float(np.sqrt(np.mean(one.amounts**2))), None
    amount, unit = float(one.amounts[0]), priors.get_prior(group.effect).std
    size = float(np.sign(amount) * abs(amount) ** (1.0 / effect.power)) * unit
    return size, float(one.std[0]) * unit


def report_cause(
    correction: Correction,
    priors: EffectPriors,
    values: Mapping[str, float],
    jacobian: FloatArray,
    std: FloatArray,
) -> list[Finding]:
    """Report the cause that the log shows: how large it is, what it moves, what to do.

    `values` are the parameters by id, `jacobian` (k, p) their derivatives by the unknowns, `std`
    (k,) their total standard deviations.
    """
    cause = find_cause(correction, priors)
    if cause is None:
        return []
    moves = jacobian @ correction.evidence[cause.group].moves
    changes = [
        f"{name} by {format_with_unit(float(move), get_parameter_spec(name).unit, digits=2)}"
        for name, move, one in zip(values, moves, std, strict=True)
        if abs(move) > one
    ]
    return [
        report(
            Code.EFFECT_FOUND if cause.is_certain else Code.EFFECT_POSSIBLE,
            effect=" or ".join(describe_group(one) for one in (cause.group, *cause.equivalent)),
            size=_format_size(cause),
            evidence=cause.evidence,
            changes=", ".join(changes) or "no value by more than its interval",
            advice=EFFECTS[cause.group.effect].remedy,
        )
    ]


def _format_size(cause: Cause) -> str:
    """Format the size of a cause in its unit."""
    if cause.std is None:
        return f"{cause.size:.2g} times its usual size"
    unit = EFFECTS[cause.group.effect].unit
    return f"{cause.size:.2g} ± {Z95 * cause.std:.1g} {unit}".removesuffix(" 1")
