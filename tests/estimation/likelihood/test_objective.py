# SPDX-License-Identifier: MIT
"""Q and its expansion, also where the weighting has lost its digits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.noise.residual_covariance import Whitener
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from tests.estimation.likelihood.fixtures import bench, problem
from tests.support.arrays import FloatArray


@dataclass(frozen=True)
class _Lost(Whitener):
    """A weighting under which the column `place` has a square of the wrong sign, or none has."""

    place: int | None = None

    def apply_inverse(self, columns: FloatArray) -> FloatArray:
        found = super().apply_inverse(columns)
        if self.place is not None and found.ndim == 2:
            found[:, self.place] *= -1.0
        return found


def _weighted_by(posed: ShiftObjective, place: int | None) -> ShiftObjective:
    """The problem under that weighting; column 0 is the residual, then come the slopes."""
    terms = (
        replace(one, weighting=_Lost(one.weighting.variance, one.weighting.path, place))
        for one in posed.terms
    )
    return replace(posed, terms=tuple(terms))


def test_the_expansion_is_that_of_q() -> None:
    posed, start = problem(bench(), off=0.002)
    normal = _weighted_by(posed, None).normal(start)
    assert normal is not None
    assert normal.cost == pytest.approx(posed.cost(start), rel=1e-12)
    assert np.linalg.eigvalsh(normal.data)[0] > 0.0


@pytest.mark.parametrize("place", [0, 1, 5])
def test_a_weighting_without_digits_expands_nothing(place: int) -> None:
    posed, start = problem(bench())
    assert _weighted_by(posed, place).normal(start) is None
