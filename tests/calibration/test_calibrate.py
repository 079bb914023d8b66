# SPDX-License-Identifier: MIT
"""A whole calibration, small: better than its start, reproducible, limits that cannot be kept."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.calibrate import calibrate
from drivetwin.calibration.keep_limits import require_limits
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


def test_a_limit_out_of_reach_leaves_the_best_calibration_and_is_named() -> None:
    found = calibrate(
        make_task((Limit(Metric.SHIFT_TIME, 0.05), Limit(Metric.FRICTION_ENERGY, 1e9)))
    )
    time = found.after.certificate.limits[0].value
    assert time < found.before.certificate.limits[0].value
    with pytest.raises(InfeasibleError, match=r"shift time \(95 %\) .* s, limit 0.05") as caught:
        require_limits(found.after.certificate.limits, found.before.certificate.limits)
    assert "friction energy" not in caught.value.what
    assert "start: " in caught.value.what
    assert "raise the limit of the shift time to" in caught.value.remedy
