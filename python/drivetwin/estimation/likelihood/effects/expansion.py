# SPDX-License-Identifier: MIT
"""Weighted columns of all effects at the minimum of a fit, with the evidence of each group.

Effects that the card excludes although the log shows them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.estimation.likelihood.effects.columns import EffectPriors, build_columns
from drivetwin.estimation.likelihood.effects.joint_step import (
    GroupEvidence,
    WeightedColumns,
    compute_evidence,
    scale_by_evidence,
    weight_columns,
)
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import SHOWN, WRONG_ENTRY, Group
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True, eq=False)
class EffectExpansion:
    """Columns of all effects, scaled to their likeliest sizes, the logarithms of these over the
    stated ones, and the evidence of each group."""

    sums: WeightedColumns
    sizes: Mapping[Group, float]
    evidence: Mapping[Group, GroupEvidence]

    @property
    def shown(self) -> set[Group]:
        """Groups that the log shows."""
        return {group for group, one in self.evidence.items() if one.nats > SHOWN}


def expand_effects(fit: LikelihoodFit, priors: EffectPriors) -> EffectExpansion | None:
    """Build the columns of all effects at the minimum; None without a linear response."""
    columns = build_columns(fit.problem, fit.point, priors)
    if columns is None:
        return None
    sums = weight_columns(fit.problem, fit.normal, columns)
    evidence = compute_evidence(sums, fit.normal.information, fit.chi2)
    scaled, sizes = scale_by_evidence(sums, fit.normal.information, fit.chi2)
    return EffectExpansion(scaled, sizes, evidence)


def admit_excluded(
    fit: LikelihoodFit, priors: EffectPriors
) -> tuple[EffectPriors, tuple[Finding, ...]]:
    """Admit effects that the card excludes and the log shows, as any entry that is wrong.

    Parameters
    ----------
    fit
        Fit of the dual clutch.
    priors
        Statements of the card on effects and sensors.

    Returns
    -------
    EffectPriors
        Statements without the exclusions that the log contradicts: with its default prior the
        effect has more log evidence than all others by `WRONG_ENTRY`.
    tuple of Finding
        A warning for each of these effects.
    """
    if not priors.excluded:
        return priors, ()
    found = expand_effects(fit, priors.drop_statements(priors.excluded))
    if found is None:
        return priors, ()
    best: dict[EffectId, float] = {}
    for group, one in found.evidence.items():
        if group.effect is not None:
            best[group.effect] = max(best.get(group.effect, 0.0), one.nats)
    allowed = max((best[name] for name in best if name not in priors.excluded), default=0.0)
    lead = {name: best[name] - allowed for name in best if name in priors.excluded}
    shown = [name for name in lead if lead[name] > WRONG_ENTRY]
    warnings = tuple(
        report(Code.EFFECT_EXCLUDED, effect=EFFECTS[one].meaning, key=one.value, evidence=lead[one])
        for one in shown
    )
    return priors.drop_statements(shown), warnings
