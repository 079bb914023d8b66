# SPDX-License-Identifier: MIT
"""Certificate: order statistics that cover as stated."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.certificate import (
    LimitState,
    certify,
    compute_quantile_bound,
    compute_share_bound,
)
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Statistic


def test_bound_of_a_quantile_covers_with_its_confidence() -> None:
    random = np.random.default_rng(5)
    bounds = [compute_quantile_bound(random.random(200), 0.95, 0.95) for _ in range(2000)]
    share = np.mean([one is not None and one >= 0.95 for one in bounds])
    assert 0.94 <= share <= 0.985  # at least 95 % but for chance; the rank is a whole number


@pytest.mark.parametrize(("share", "least"), [(0.95, 59), (0.99, 299)])
def test_least_number_of_draws(share: float, least: int) -> None:
    # 1 - share^n reaches 95 % at these numbers.
    assert compute_quantile_bound(np.arange(float(least - 1)), share, 0.95) is None
    assert compute_quantile_bound(np.arange(float(least)), share, 0.95) == least - 1.0


def test_no_mark_bounds_the_share_by_the_rule_of_three() -> None:
    none = np.zeros(300, dtype=np.bool_)
    assert compute_share_bound(none, 0.95) == pytest.approx(1.0 - 0.05 ** (1.0 / 300.0))
    assert compute_share_bound(~none, 0.95) == 1.0


def test_states_of_limits() -> None:
    values = np.linspace(0.0, 1.0, 1001)
    no = np.zeros(values.size, dtype=np.bool_)
    outcome = Outcome({Metric.SHIFT_TIME: values}, np.zeros((values.size, 2)), no, no)
    bounds = (0.99, 0.951, 0.9)
    found = certify(outcome, [Limit(Metric.SHIFT_TIME, one) for one in bounds], 0.95)
    states = [one.state for one in found.limits]
    assert states == [LimitState.CERTIFIED, LimitState.KEPT, LimitState.EXCEEDED]
    assert [one.binding for one in found.limits] == [False, True, True]
    (mean,) = certify(outcome, [Limit(Metric.SHIFT_TIME, 0.6, Statistic.MEAN)], 0.95).limits
    assert mean.state is LimitState.CERTIFIED
    assert mean.value == pytest.approx(0.5)
    assert found.worst_share == pytest.approx(0.05 ** (1.0 / 1001.0))
