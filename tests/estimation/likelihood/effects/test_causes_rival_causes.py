# SPDX-License-Identifier: MIT
"""Values between causes that explain the log equally well."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.causes import widen_by_rivals
from drivetwin.estimation.likelihood.effects.correction import Correction, keep_fit
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.result.cause import Cause, Group
from drivetwin.vehicle.effects import EffectId
from tests.estimation.likelihood.fixtures import fitted
from tests.support.arrays import FloatArray

HEAT, LATE = (Group(one, "B3") for one in (EffectId.FRICTION_HEAT, EffectId.PRESSURE_DELAY))
MOVE = 3.0


def _corrected(lead: float) -> tuple[Correction, Cause, FloatArray]:
    """Return a correction with two causes, `lead` apart, that move the first unknown by ±3."""
    kept = keep_fit(fitted())
    unit = np.zeros(kept.mean.values.size)
    unit[0] = MOVE
    one = np.ones(1)
    evidence = {
        HEAT: GroupEvidence(20.0 + lead, one, one, (0,), one, unit),
        LATE: GroupEvidence(20.0, one, one, (1,), one, -unit),
    }
    cause = Cause(HEAT, 20.0 + lead, 0.03, 0.001, (), 20.0)
    return replace(kept, evidence=evidence), cause, unit


def test_two_equal_causes_widen_by_what_each_would_move() -> None:
    kept, cause, unit = _corrected(0.0)
    wide = widen_by_rivals(kept, fitted(), cause)
    assert wide.covariance - kept.covariance == pytest.approx(np.outer(unit, unit), abs=1e-9)


def test_a_cause_that_leads_changes_nothing() -> None:
    kept, cause, _ = _corrected(6.0)
    assert widen_by_rivals(kept, fitted(), cause) is kept
    assert widen_by_rivals(kept, fitted(), None) is kept
