# SPDX-License-Identifier: MIT
"""The profile of a parameter that acts nearly linearly is a parabola about the estimate."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import IdentificationError, InputError
from drivetwin.identify.profile import profile
from tests.identify.asked import by_the_paper, stepped


@pytest.mark.parametrize("name", ["eta", "J_prime_3"])
def test_agrees_with_the_covariance(name: str) -> None:
    """One is an unknown of the fit, the other follows from two of them."""
    one = profile(stepped(), name)
    half = 0.5 * (one.linear[1] - one.linear[0])
    assert one.interval == pytest.approx(one.linear, abs=0.1 * half)
    distance = (one.values - one.estimate) / (half / 1.96)
    assert one.rise == pytest.approx(distance**2, rel=0.15, abs=0.3)
    assert one.rise[np.argmin(np.abs(distance))] == 0.0


@pytest.mark.parametrize(("name", "match"), [("k_x", "choose one of eta"), ("P0.B2", "design")])
def test_refuses_what_does_not_move(name: str, match: str) -> None:
    with pytest.raises(InputError, match=match):
        profile(stepped(), name)


def test_refuses_other_methods() -> None:
    with pytest.raises(IdentificationError, match="paper method"):
        profile(by_the_paper(), "eta")
