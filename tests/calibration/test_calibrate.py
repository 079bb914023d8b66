# SPDX-License-Identifier: MIT
"""A whole calibration, small: better than its start, reproducible, limits that cannot be kept."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.calibrate import calibrate
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit
from drivetwin.errors import InfeasibleError
from tests.calibration.cases import make_task


def test_improves_on_fresh_draws_and_repeats_itself() -> None:
    task = make_task((Limit(Metric.SHIFT_TIME, 0.95),))
    first, again = calibrate(task), calibrate(task)
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95 for one in (first.before, first.after)
    )
    assert new < 0.9 * old
    assert np.array_equal(first.after.values, again.after.values)
    assert first.after.certificate.limits[0].value <= 0.95
    assert first.runs == again.runs > 0


def test_limits_that_cannot_be_kept_are_named() -> None:
    task = make_task((Limit(Metric.SHIFT_TIME, 0.05), Limit(Metric.FRICTION_ENERGY, 1e9)))
    with pytest.raises(InfeasibleError, match=r"shift time \(95 %\) .* s, limit 0.05") as caught:
        calibrate(task)
    assert "friction energy" not in caught.value.what
