# SPDX-License-Identifier: MIT
"""A cause counts as found only if it explains the log by a plausible size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.causes import find_cause, report_cause, widen_by_rivals
from drivetwin.estimation.likelihood.effects.correction import Correction, keep_fit
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.fit import PlantEvidence
from drivetwin.estimation.result.cause import Cause, Group
from drivetwin.findings import Code
from drivetwin.vehicle.effects import EffectId
from tests.estimation.likelihood.fixtures import fitted
from tests.support.arrays import FloatArray

LATE = Group(EffectId.PRESSURE_DELAY, "B3")


def _corrected(size: float, std: float, chi2: float = 1.0) -> Correction:
    """Return a correction with evidence for a pressure that is late by `size` ± `std` [s]."""
    kept = keep_fit(fitted())
    moves = np.zeros(kept.mean.values.size)
    one = GroupEvidence(50.0, np.array([size]), np.array([std]), (0,), np.ones(1), moves)
    return replace(kept, evidence={LATE: one}, step=replace(kept.step, chi2=chi2))


@pytest.mark.parametrize(
    ("size", "std", "after", "before", "explained"),
    [
        (0.005, 3e-4, 1.0, 1.0, True),
        (0.005, 3e-4, 1.34, 1.0, False),
        (0.005, 3e-4, 1.0, 1.3, False),
        (-0.00012, 3e-4, 1.0, 1.0, False),
    ],
)
def test_a_cause_explains_the_log_by_its_residual_and_its_size(
    size: float, std: float, after: float, before: float, *, explained: bool
) -> None:
    kept, fit = _corrected(size, std, after), replace(fitted(), chi2=before)
    cause = find_cause(kept, fit)
    assert cause is not None
    assert cause.is_alone
    assert cause.is_explained is cause.is_certain is explained
    finding = report_cause(cause, kept, {}, np.empty((0, 1)), np.empty(0))
    assert finding.code is (Code.EFFECT_FOUND if explained else Code.EFFECT_RESEMBLED)
    assert explained or "resembles" in finding.text


def test_the_sign_of_a_delay_is_explained() -> None:
    for size, told in ((-0.005, True), (0.005, False)):
        kept = _corrected(size, 3e-4)
        cause = find_cause(kept, fitted())
        assert cause is not None
        text = report_cause(cause, kept, {}, np.empty((0, 1)), np.empty(0)).text
        assert ("the measured pressure is late" in text) is told
        assert "5.00 ± 0.59 ms" in text


def test_a_part_of_the_plant_at_a_bound_resembles_only() -> None:
    fit, mode = fitted(), Group(EffectId.INPUT_SHAFT_MODE)
    moves, last = np.zeros(fit.point.values.size), fit.point.values.size - 1
    one = GroupEvidence(50.0, np.array([20.0]), np.array([0.5]), (), np.empty(0), moves)
    kept = replace(keep_fit(fit), evidence={mode: one})
    plant = replace(fit, plant=PlantEvidence(EffectId.INPUT_SHAFT_MODE, 50.0, moves, last))
    lower = fit.problem.lower.copy()
    lower[last] = fit.point.values[last]
    bound = replace(plant, problem=replace(fit.problem, lower=lower))
    found = [find_cause(kept, one) for one in (plant, bound)]
    assert [one is not None and one.is_explained for one in found] == [True, False]


HEAT = Group(EffectId.FRICTION_HEAT, "B3")
MOVE = 3.0


def _corrected_by_two(lead: float) -> tuple[Correction, Cause, FloatArray]:
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
    kept, cause, unit = _corrected_by_two(0.0)
    wide = widen_by_rivals(kept, fitted(), cause)
    assert wide.covariance - kept.covariance == pytest.approx(np.outer(unit, unit), abs=1e-9)


def test_a_cause_that_leads_changes_nothing() -> None:
    kept, cause, _ = _corrected_by_two(6.0)
    assert widen_by_rivals(kept, fitted(), cause) is kept
    assert widen_by_rivals(kept, fitted(), None) is kept
