# SPDX-License-Identifier: MIT
"""Global search on functions with known minima."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from drivetwin._util.progress import attach_listener
from drivetwin.calibration.search import search_minima
from drivetwin.calibration.settings import CalibrationSettings
from tests.support.arrays import FloatArray

SETTINGS = CalibrationSettings(
    starts=3, finalists=2, population=10, first_evaluations=100, evaluations=600
)
CENTRE = np.array([0.3, 0.7, 0.0, 0.5])


def _bowl(candidates: Sequence[FloatArray]) -> list[float]:
    return [float(np.sum((at - CENTRE) ** 2)) for at in candidates]


def test_finds_a_minimum_also_on_a_bound() -> None:
    found = search_minima(_bowl, np.full(4, 0.5), SETTINGS, seed=1)
    assert len(found) == 2
    assert found[0].value <= found[1].value
    assert found[0].coordinates == pytest.approx(CENTRE, abs=1e-2)


def test_equal_seeds_give_equal_minima() -> None:
    first, again = (search_minima(_bowl, np.full(4, 0.5), SETTINGS, seed=4) for _ in range(2))
    assert (first[0].coordinates == again[0].coordinates).all()


def test_a_listener_cancels() -> None:
    class Cancelled(Exception):
        pass

    def cancel(share: float, _: str) -> None:
        if share > 0.3:
            raise Cancelled

    with attach_listener(cancel), pytest.raises(Cancelled):
        search_minima(_bowl, np.full(4, 0.5), SETTINGS, seed=1)
