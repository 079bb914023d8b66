# SPDX-License-Identifier: MIT
"""A cause counts as found only if it explains the log by a plausible size."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.causes import find_cause, widen_by_rivals
from drivetwin.estimation.likelihood.effects.correction import keep_fit
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId
from tests.estimation.likelihood.fixtures import fitted

LATE, HEAT = Group(EffectId.PRESSURE_DELAY, "B3"), Group(EffectId.FRICTION_HEAT, "B3")
ONE = np.ones(1)


def _correct(
    evidence: dict[Group, tuple[float, float, float]], chi2: float = 1.0, cosine: float = 0.0
) -> Any:
    """Return a correction with evidence: nats, amount of a column, move of the first unknown.

    The fitted effects of two causes have the `cosine`.
    """
    kept = keep_fit(fitted())
    found = {}
    for k, (group, (nats, amount, move)) in enumerate(evidence.items()):
        moves, answer = np.zeros(kept.mean.values.size), np.full(len(evidence), cosine)
        moves[0], answer[k] = move, 1.0
        found[group] = GroupEvidence(nats, amount * ONE, 3e-4 * ONE, (k,), answer, moves)
    return replace(kept, evidence=found, step=replace(kept.step, chi2=chi2))


@pytest.mark.parametrize(
    ("size", "after", "before", "explained"),
    [
        (0.005, 1.0, 1.0, True),
        (0.005, 1.34, 1.0, False),
        (0.005, 1.0, 1.3, False),
        (-0.00012, 1.0, 1.0, False),
    ],
)
def test_a_cause_explains_the_log_by_its_residual_and_its_size(
    size: float, after: float, before: float, *, explained: bool
) -> None:
    cause = find_cause(_correct({LATE: (50.0, size, 0.0)}, after), replace(fitted(), chi2=before))
    assert cause is not None
    assert cause.is_alone
    assert cause.is_explained is cause.is_certain is explained


@pytest.mark.parametrize(("nats", "found"), [(5.6, False), (5.8, True)])
def test_evidence_must_lead_by_the_odds_of_all_causes(nats: float, *, found: bool) -> None:
    """ln B above 5 and the logarithm of the count of causes."""
    cause = find_cause(_correct({LATE: (nats, 0.005, 0.0), HEAT: (0.0, 0.0, 0.0)}), fitted())
    assert (cause is not None) is found


@pytest.mark.parametrize("lead", [0.0, 6.0])
def test_equal_rivals_widen_by_what_each_would_move(lead: float) -> None:
    kept = _correct({HEAT: (20.0 + lead, 1.0, 3.0), LATE: (20.0, 1.0, -3.0)}, cosine=0.89)
    wide = widen_by_rivals(kept, fitted(), find_cause(kept, fitted()))
    added = np.zeros_like(kept.covariance)
    added[0, 0] = 9.0 * (lead == 0.0)
    assert wide.covariance - kept.covariance == pytest.approx(added, abs=1e-9)


def test_a_cause_that_no_column_tells_from_it_does_not_compete() -> None:
    cause = find_cause(
        _correct({HEAT: (20.0, 1.0, 3.0), LATE: (20.0, 1.0, -3.0)}, cosine=0.91), fitted()
    )
    assert cause is not None
    assert cause.is_alone
    assert cause.equivalent == (LATE,)
