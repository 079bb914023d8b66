# SPDX-License-Identifier: MIT
"""Spread of the values over causes between which the log does not decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import LEAD, Cause


def widen_by_rivals(correction: Correction, fit: LikelihoodFit, cause: Cause | None) -> Correction:
    """Widen a correction by what the values would be if a single one of the near causes acted.

    The joint step divides a departure between all effects by their priors. Where several causes
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
    applied = correction.mean.values - fit.mean.values
    apart = np.array([one.moves[: applied.size] - applied for one in near])
    extra = (apart.T * (weights / weights.sum())) @ apart
    return replace(correction, covariance=correction.covariance + extra)
