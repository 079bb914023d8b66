# SPDX-License-Identifier: MIT
"""What an identification returns: intervals hold what they say."""

from __future__ import annotations

import pytest
from scipy.stats import norm

from drivetwin.estimation.result.estimate import Z95, Estimate, Verdict


def test_an_interval_holds_95_percent_of_a_normal_distribution() -> None:
    one = Estimate("k_o", 1e5, 300.0, Verdict.IDENTIFIED, "m", std_systematic=400.0)
    assert pytest.approx(norm.ppf(0.975), rel=1e-14) == Z95
    for ends, std in ((one.ci95, 300.0), (one.ci95_total, 500.0)):
        assert ends is not None
        assert norm.cdf(ends[1], 1e5, std) - norm.cdf(ends[0], 1e5, std) == pytest.approx(0.95)
