# SPDX-License-Identifier: MIT
"""Weighted columns of all effects at the minimum of a fit, with the evidence of each group."""

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
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import SHOWN, Group


@dataclass(frozen=True, eq=False)
class EffectExpansion:
    """Columns of all effects, scaled to their likeliest sizes, and the evidence of each group."""

    sums: WeightedColumns
    evidence: Mapping[Group, GroupEvidence]

    @property
    def shown(self) -> set[Group]:
        """Groups that the log shows."""
        return {group for group, one in self.evidence.items() if one.nats > SHOWN}


def expand_effects(fit: LikelihoodFit, priors: EffectPriors) -> EffectExpansion | None:
    """Form the columns of all effects at the minimum; None without a linear response."""
    columns = build_columns(fit.problem, fit.point, priors)
    if columns is None:
        return None
    sums = weight_columns(fit.problem, fit.normal, columns)
    evidence = compute_evidence(sums, fit.normal.information, fit.chi2)
    return EffectExpansion(scale_by_evidence(sums, fit.normal.information, fit.chi2), evidence)
