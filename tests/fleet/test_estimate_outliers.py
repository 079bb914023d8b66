# SPDX-License-Identifier: MIT
"""Units that do not belong to the rest: rarely found where there are none, also among few."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.fleet.estimate import compute_unit_limit, compute_unit_scores

FLEETS = 4000
FALSE_ALARMS = 0.05
"""Share of fleets without an odd unit in which one is named, as the page states."""


@pytest.mark.parametrize("count", [5, 8, 11, 12, 20, 50])
def test_false_alarms_are_as_rare_as_stated(count: int) -> None:
    draws = np.random.default_rng(count).standard_normal((FLEETS, count))
    farthest = np.array([np.abs(compute_unit_scores(units)).max() for units in draws])
    alarms = np.mean(farthest > compute_unit_limit(count))
    # Three standard deviations of a share that is estimated from so many fleets.
    assert alarms < FALSE_ALARMS + 3.0 * np.sqrt(FALSE_ALARMS / FLEETS)


def test_one_of_five_units_is_found() -> None:
    deviation = np.array([1.0, -0.5, 0.2, 30.0, -0.9])
    assert (np.abs(compute_unit_scores(deviation)) > compute_unit_limit(5)).tolist() == [
        0,
        0,
        0,
        1,
        0,
    ]
    assert np.isnan(compute_unit_scores(deviation[:4])).all()
