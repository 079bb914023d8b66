# SPDX-License-Identifier: MIT
"""Sign of a pressure delay: a positive one acts later than the logged pressure."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.operating_point import evaluate_operating_point
from drivetwin.estimation.likelihood.effects.pressure_delay import build
from tests.estimation.likelihood.fixtures import bench, fitted

LATE = 0.003


def test_a_positive_delay_acts_later_than_the_logged_pressure() -> None:
    fit = fitted()
    (part,) = fit.problem.parts
    at = evaluate_operating_point(part, fit.point)
    assert at is not None
    for one in build(at, LATE):
        signal = bench().signals.pressures[one.subject]
        now, before = (np.interp(at.middle - age, signal.time, signal.values) for age in (0, 0.1))
        change = one.inputs[one.subject]
        slope = float(change @ (before - now)) / float((before - now) @ (before - now))
        assert 0.0 < slope < 1.0
        assert slope == pytest.approx(LATE / 0.1, rel=0.5)
