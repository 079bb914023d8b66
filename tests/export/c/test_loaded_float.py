# SPDX-License-Identifier: MIT
"""Single precision where its round-off is coarse: what goes on in double goes on here too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.export.c.loaded import CModel, Precision
from drivetwin.export.targets import InputKind
from drivetwin.simulation.dual_clutch import RoadLoad, State
from tests.export.c.test_loaded import set_model
from tests.export.cases import (
    paper_model,
    paper_subject,
    run_core,
)

TIME = np.linspace(0.0, 0.3, 301)
IDLE = State(151.0, 79.0, 14.7, 0.013)


@pytest.fixture(scope="module")
def loaded() -> CModel:
    return CModel(paper_subject(), Precision.FLOAT)


@pytest.mark.parametrize("J2e", [0.0, 2e-3])
def test_an_engine_that_nothing_loads_follows_its_torque(loaded: CModel, J2e: float) -> None:
    """Both elements open behind a gear that loses power in either direction: what passes it is the
    small difference of large terms, through zero twenty times in all. The speed is the integral of
    torque over inertia, J1 alone or J1 behind the gear with the little that it drives."""
    model = replace(paper_model(), J2e=J2e, loss_law="dissipative")
    set_model(loaded, model, IDLE)
    torque = 200.0 * np.cos(2.0 * np.pi * 33.0 * TIME)
    run = loaded.run(TIME, np.column_stack([torque, np.zeros((TIME.size, 2))]))
    assert run.status == "completed"
    gained = np.concatenate([[0.0], np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(TIME))])
    expected = IDLE.engine_speed + gained / (model.J1 + J2e)
    assert run.columns["engine_speed"] == pytest.approx(expected, rel=1e-5)


def test_a_wheel_that_moves_for_a_moment_comes_to_rest_again(loaded: CModel) -> None:
    """The shaft exceeds the rolling resistance by what it loses again in 50 µs."""
    rolling, turning = 800.0, 2.0
    model = replace(paper_model(), load=RoadLoad(0.0, rolling), c_o=0.0)
    twist = rolling / (model.i_f * model.k_o) + 50e-6 * turning
    start = State(100.0, -turning, 0.0, twist)
    set_model(loaded, model, start)
    inputs = np.zeros((TIME.size, 3))
    run = loaded.run(TIME[:21], inputs[:21])
    core = run_core(model, start, TIME[:21], inputs[:21], InputKind.LINEAR)
    assert run.status == core.status == "completed"
    assert run.columns["output_torque"] == pytest.approx(core.shaft_torque, abs=0.1)
    assert run.columns["wheel_speed"] == pytest.approx(core.wheel_speed, abs=1e-6)
