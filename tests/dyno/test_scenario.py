# SPDX-License-Identifier: MIT
"""Torque reduction of the TCU."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno.scenario import TorqueReduction
from drivetwin.errors import InputError


def test_torque_comes_down_and_back_by_ramps() -> None:
    reduction = TorqueReduction(0.4, start=1.0, end=1.5, ramp=0.1)
    time = np.array([0.9, 1.0, 1.05, 1.1, 1.5, 1.55, 1.6, 2.0])
    assert np.allclose(reduction.compute_factor(time), [1.0, 1.0, 0.8, 0.6, 0.6, 0.8, 1.0, 1.0])


@pytest.mark.parametrize("fraction", [-0.1, 1.0, 30.0])
def test_fraction_must_be_a_share(fraction: float) -> None:
    with pytest.raises(InputError, match="share"):
        TorqueReduction(fraction, 1.0, 1.5)


@pytest.mark.parametrize(("end", "ramp"), [(1.02, 0.05), (0.5, 0.05), (1.5, 0.0), (1.5, -0.1)])
def test_a_reduction_that_goes_before_it_has_come_is_refused(end: float, ramp: float) -> None:
    with pytest.raises(InputError, match="a ramp of"):
        TorqueReduction(0.3, 1.0, end, ramp)
