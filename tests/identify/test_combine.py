# SPDX-License-Identifier: MIT
"""Several shifts into one value each: derived parameters stay consistent, priors count once."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from drivetwin.identify.combine import combine
from drivetwin.identify.integral import IntegralShift
from drivetwin.identify.signals import FloatArray
from drivetwin.vehicle.spec import PriorValue


def _shift(ids: tuple[str, ...], values: list[float], covariance: FloatArray) -> IntegralShift:
    nothing = cast("Any", None)
    return IntegralShift(
        nothing, nothing, nothing, None, ids, np.array(values), covariance, refusals={}
    )


def test_a_parameter_that_follows_from_others_still_does() -> None:
    """Basic x and a gear's own z; derived y = 2x + z exactly, so every covariance is singular."""
    derive = np.array([[1.0, 0.0], [0.0, 1.0], [2.0, 1.0]])

    def shift(gear: str, x: float, z: float, std_z: float) -> IntegralShift:
        covariance = derive @ np.diag([0.04, std_z**2]) @ derive.T
        ids = ("J_vehicle", f"f_d_{gear}", "k_o")
        return _shift(ids, [x, z, 2.0 * x + z], covariance)

    ids, values, covariance = combine([shift("3", 5.1, 7.2, 0.01), shift("4", 4.9, 7.4, 0.3)], None)
    found = dict(zip(ids, values, strict=True))
    stds = dict(zip(ids, np.sqrt(np.diag(covariance)), strict=True))
    for gear in ("3", "4"):
        assert found["k_o"] == pytest.approx(2.0 * found["J_vehicle"] + found[f"f_d_{gear}"])
    assert stds["J_vehicle"] < 0.2
    assert stds["k_o"] < np.hypot(2.0 * stds["J_vehicle"], 0.01) * 1.01


def test_equal_shifts_halve_the_variance_but_for_the_prior() -> None:
    prior = PriorValue(1.0, 0.1)
    data = 0.2
    std = (prior.std**-2 + data**-2) ** -0.5
    one = _shift(("eta", "J_out"), [0.85, 1.05], np.diag([0.01**2, std**2]))
    ids, values, covariance = combine([one, one], prior)
    assert ids == ("eta", "J_out")
    assert covariance[0, 0] == pytest.approx(0.01**2 / 2.0, rel=1e-5)
    assert covariance[1, 1] == pytest.approx(1.0 / (prior.std**-2 + 2.0 * data**-2), rel=1e-5)
    # 1.05 is the prior 1.0 and data 1.25 weighted; twice the data pulls further.
    assert values[1] == pytest.approx((1.0 / 0.01 + 2.0 * 1.25 / 0.04) / (1.0 / 0.01 + 2.0 / 0.04))


def test_one_shift_stays_as_it_is() -> None:
    one = _shift(("eta",), [0.85], np.array([[1e-4]]))
    ids, values, covariance = combine([one], None)
    assert (ids, values[0], covariance[0, 0]) == (("eta",), 0.85, 1e-4)
