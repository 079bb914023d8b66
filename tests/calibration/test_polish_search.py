# SPDX-License-Identifier: MIT
"""Search of a calibration: hops reach the best of many minima, and its draws are designed."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.calibrate import draw_for
from drivetwin.calibration.polish import Candidate, search_minima
from drivetwin.calibration.scenarios import Purpose
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.twin_task import Request, build_task
from tests.calibration.twins import make_exact_twin
from tests.support.arrays import FloatArray


def improve(at: FloatArray) -> Candidate:
    """Descend to the minimum of the cell of `at`: cells of width 0.1, the best at 0.65."""
    found = np.clip(np.round((at - 0.05) / 0.1) * 0.1 + 0.05, 0.05, 0.95)
    return Candidate(found, float(np.sum((found - 0.65) ** 2)))


@pytest.mark.parametrize("seed", range(3))
def test_hops_reach_the_best_of_many_minima(seed: int) -> None:
    start = [np.full(4, 0.25)]

    def search(hops: int) -> list[Candidate]:
        return search_minima(improve, start, hops, 0.07, np.random.default_rng(seed))

    found = search(200)
    values = [one.value for one in found]
    assert values == sorted(values)
    assert values[0] <= 0.011
    alone = search(2)
    assert alone[0].value > 5.0 * values[0]
    coordinates = {tuple(one.coordinates.round(3).tolist()) for one in found}
    assert len(coordinates) == len(found)
    assert [one.value for one in search(200)] == values


def test_hops_move_a_profile_in_time() -> None:
    """The minima are one bump at several knots, too far apart for steps of the coordinates."""
    bumps = np.eye(6)

    def improve(at: FloatArray) -> Candidate:
        nearest = int(np.argmin(np.abs(bumps - at).sum(axis=1)))
        return Candidate(bumps[nearest], float(nearest))

    found = search_minima(improve, [bumps[4]], 400, 0.05, np.random.default_rng(0))
    assert found[0].value == 0.0


def test_draws_of_the_optimiser_are_designed_and_others_random() -> None:
    """Means of 64 designed gains have less than a tenth of the error of random ones."""
    spread = Spread(oil_temperature=0.0)
    errors: dict[Purpose, list[float]] = {Purpose.POLISH: [], Purpose.CERTIFICATE: []}
    for seed in range(6):
        request = Request(gears=("2", "3"), spread=spread, limits=(), seed=seed)
        task = build_task(make_exact_twin(), request)
        for purpose, own in errors.items():
            gains = draw_for(task, 64, purpose).sets["B3.gain"]
            own.append(float(gains.mean() / task.maneuver.oncoming.gain - 1.0) / (0.025 / 8.0))
    designed, random = (float(np.sqrt(np.mean(np.square(one)))) for one in errors.values())
    assert 0.4 < random < 2.0
    assert designed < 0.1 * random
