# SPDX-License-Identifier: MIT
"""Runs over scenarios: independent of chunks, and of which metrics are asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration import evaluate
from drivetwin.calibration.controller_policy import build_controller_policy
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.policy import Space
from tests.calibration.cases import SYSTEM, make_draws, make_plant, make_upshift


def test_chunks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    shift = make_upshift(step=2e-3)
    space, plant, draws = (
        Space(build_controller_policy(shift, SYSTEM)),
        make_plant(shift),
        make_draws(shift, 7),
    )
    profiles = space.build_control(space.start)
    whole = plant.evaluate(profiles, draws)
    monkeypatch.setattr(evaluate, "_CHUNK", 3)
    parts = plant.evaluate(profiles, draws)
    for name, values in whole.values.items():
        assert values == pytest.approx(parts.values[name], rel=1e-9, abs=1e-9)
    assert plant.count.runs == 14
    few = replace(plant, metrics=(Metric.FLARE,)).evaluate(profiles, draws)
    assert set(few.values) == {Metric.FLARE}
    assert np.array_equal(few.jerk.shape, whole.jerk.shape)


def test_late_pressures_move_the_shift_by_their_delay() -> None:
    """With a constant engine torque, a delay of all pressures moves the lock-up."""
    shift = make_upshift()
    policy = build_controller_policy(shift, SYSTEM).set_start({"reduction_depth": 0.0})
    space = Space(policy)
    control = space.build_control(space.start)
    locks = []
    for delay in (0.0, 0.01):
        plant, draws = make_plant(replace(shift, pressure_delay=delay)), make_draws(shift, 4)
        locks.append(plant.simulate(control, draws, (shift.body.drive,))[1])
    np.testing.assert_allclose(locks[1] - locks[0], 0.01, rtol=0.1)
