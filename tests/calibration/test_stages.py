# SPDX-License-Identifier: MIT
"""Stages: a finished one is not repeated, its runs count, an impossible one is."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.stages import NO_STAGES, Stage, run_stage
from tests.calibration.cases import make_plant, make_upshift
from tests.support.arrays import FloatArray


class Store:
    """Stages in memory."""

    def __init__(self, **stages: Stage) -> None:
        self.stages = stages

    def recall(self, name: str) -> Stage | None:
        return self.stages.get(name)

    def keep(self, name: str, stage: Stage) -> None:
        self.stages[name] = stage


def test_a_finished_stage_is_not_repeated_and_its_runs_count() -> None:
    plant, store = make_plant(make_upshift()), Store()

    def work() -> FloatArray:
        plant.count.runs += 7
        return np.array([0.25, 0.5])

    for calls in (1, 2):
        found = run_stage(store, "one", (plant, 2), work)
        assert found.tolist() == [0.25, 0.5]
        assert plant.count.runs == 7 * calls
    assert store.stages["one"].runs == 7


@pytest.mark.parametrize("values", [[0.5], [0.5, 1.5], [0.5, float("nan")]])
def test_impossible_coordinates_count_as_unfinished(values: list[float]) -> None:
    plant, store = make_plant(make_upshift()), Store(one=Stage(np.array(values), 3))
    found = run_stage(store, "one", (plant, 2), lambda: np.zeros(2))
    assert found.tolist() == [0.0, 0.0]
    assert plant.count.runs == 0
    assert store.stages["one"].runs == 0


def test_without_a_store_nothing_is_kept() -> None:
    plant = make_plant(make_upshift())
    assert run_stage(NO_STAGES, "one", (plant, 1), lambda: np.ones(1)).tolist() == [1.0]
    assert NO_STAGES.recall("one") is None
