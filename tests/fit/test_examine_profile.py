# SPDX-License-Identifier: MIT
"""Profile likelihood of the unknowns of a fit."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.fit.examine import compute_profile
from drivetwin.fit.fit import fit_network
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from tests.support.fits import fit_log, make_log, make_small


@pytest.mark.parametrize("unknown", ["shaft.damping", "vehicle.inertia"])
def test_the_interval_is_that_of_the_covariance_where_the_fit_is_nearly_linear(
    unknown: str,
) -> None:
    found = fit_log(ModelName.ENGINE_START)
    one = compute_profile(found, unknown)
    assert one.estimate == pytest.approx(found.values[unknown])
    low, high = one.interval
    assert low < make_log(ModelName.ENGINE_START).truth[unknown] < high
    assert (high - low) / np.diff(one.linear)[0] == pytest.approx(1.0, abs=0.15)
    assert np.min(one.rise) > -0.1


def test_an_unknown_of_a_fit_without_logarithm_has_a_profile() -> None:
    model, recording = make_small({"delay.torque": Unknown(0.0, 0.01)})
    found = fit_network(model, [recording])
    one = compute_profile(found, "delay.torque")
    assert one.interval[0] < found.values["delay.torque"] < one.interval[1]
    assert np.diff(one.interval)[0] / np.diff(one.linear)[0] == pytest.approx(1.0, abs=0.15)


def test_a_name_that_is_no_unknown_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"no unknown 'K0\.gain'") as caught:
        compute_profile(fit_log(ModelName.ENGINE_START), "K0.gain")
    assert "K0.friction.mu_c" in caught.value.remedy
