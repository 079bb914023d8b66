# SPDX-License-Identifier: MIT
"""Friction curves of a fit: over which slips they go."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.likelihood.effects.correction import keep_fit
from drivetwin.estimation.likelihood.shift_objective import ShiftTerm
from drivetwin.estimation.likelihood.uncertainty.friction_bands import build_friction_curves
from tests.estimation.likelihood.fixtures import fitted


def test_a_curve_goes_over_the_slips_of_all_shifts_and_not_of_the_first_alone() -> None:
    """An element may let go in the first shift of a log, under little slip, and come on later."""
    fit = fitted()
    (whole,) = fit.problem.terms
    oncoming = whole.structure.driveline.oncoming.name
    run = whole.simulate(fit.point)
    assert run is not None
    lock = next(one.time for one in run.events if (one.kind, one.element) == ("lock", oncoming))
    brief = ShiftTerm.from_sensor_noise(whole.structure, whole.record.cut(lock - 0.15))
    alone = build_friction_curves(fit, {}, keep_fit(fit))[oncoming]
    both = replace(fit, problem=replace(fit.problem, terms=(brief, whole)))
    joined = build_friction_curves(both, {}, keep_fit(fit))[oncoming]
    assert joined.slip[[0, -1]] == pytest.approx(alone.slip[[0, -1]])
    short = replace(fit, problem=replace(fit.problem, terms=(brief,)))
    cut = build_friction_curves(short, {}, keep_fit(fit))[oncoming]
    assert cut.slip[0] > 10.0 * alone.slip[0]
