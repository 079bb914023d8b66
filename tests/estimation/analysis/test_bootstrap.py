# SPDX-License-Identifier: MIT
"""The bootstrap's spread is that of the covariance where the model holds."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.analysis.bootstrap import MIN_FITS, bootstrap
from tests.estimation.asked import stepped


@pytest.mark.statistical
@pytest.mark.short
def test_spread_agrees_with_the_covariance() -> None:
    """Of ten refits a standard deviation is known to a quarter; over nine parameters together the
    ratio to that of the covariance is near one."""
    found = stepped()
    one = bootstrap(found, MIN_FITS, seed=5)
    assert one.failed <= MIN_FITS // 3
    assert one.values.shape == (MIN_FITS - one.failed, len(one.ids))
    names = ("eta", "J_prime_2", "J_out", "te_delay", "J_vehicle", "Tv_over_if", "k_o", "c_o")
    linear = np.array([found.estimates[n].std_noise for n in names], dtype=float)
    place = [one.ids.index(n) for n in names]
    ratio = one.std[place] / linear
    assert 0.6 < np.exp(np.mean(np.log(ratio))) < 1.5
    assert np.abs(one.bias[place] / linear).max() < 3.0 / np.sqrt(MIN_FITS) * 1.5


def test_too_few_are_refused() -> None:
    with pytest.raises(InputError, match="too small for a spread"):
        bootstrap(stepped(), MIN_FITS - 1, seed=0)
