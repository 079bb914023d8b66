# SPDX-License-Identifier: MIT
"""The exported C where its range ends: an engine that stands or turns backward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.export.c.loaded import CModel
from drivetwin.simulation.dual_clutch import State
from tests.export.c.test_loaded import set_model
from tests.export.cases import paper_model, paper_subject


@pytest.mark.parametrize("speed", [-50.0, 0.0])
def test_an_engine_that_does_not_turn_forward_is_told(speed: float) -> None:
    """Nothing but its own negative torque acts on the engine."""
    loaded = CModel(paper_subject())
    model = replace(paper_model(), loss_law="dissipative")
    start = State(speed, 0.0, 0.0, 0.0)
    set_model(loaded, model, start)
    time, inputs = np.array([0.0, 0.01]), np.tile((-300.0, 0.0, 0.0), (2, 1))
    run = loaded.run(time, inputs)
    assert run.status == "engine stalled"
    assert np.isnan(run.columns["engine_speed"]).all()
    set_model(loaded, replace(model, loss_law="paper"), start)
    assert loaded.run(time, inputs).columns["engine_speed"][-1] < speed
