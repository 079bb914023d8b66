# SPDX-License-Identifier: MIT
"""A search that ends at its limit has found no minimum, and says so."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.multistart import fit_local
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from tests.estimation.likelihood.fixtures import bench, problem
from tests.support.bench import NO_EFFECT

SHORT = 0.003
"""Distance from the age that the log has to the limit of the search [s]."""


def test_an_age_at_the_limit_of_the_search_is_not_identified() -> None:
    made = bench()
    posed, start = problem(made)
    upper = posed.upper.copy()
    upper[start.names.index("te_delay")] = limit = made.truth["te_delay"] - SHORT
    fit = fit_local(replace(posed, upper=upper), start)
    assert fit is not None
    concluded = build_estimates(fit, [made.signals], [made.driveline], EffectPriors(NO_EFFECT))
    age = concluded.estimates["te_delay"]
    assert age.value == pytest.approx(limit)
    assert age.verdict is Verdict.WEAK
    assert "the bound of the search; the log indicates a larger value" in age.reason
    assert Code.AT_BOUND in [one.code for one in concluded.findings if one.subject == "te_delay"]
