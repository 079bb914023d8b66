# SPDX-License-Identifier: MIT
"""The exported C refuses samples beyond any vehicle and keeps its state."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.export.c.loaded import STATUS, CModel, CObserver, Precision
from tests.export.c.test_loaded import pressed_for
from tests.export.cases import paper_subject


@pytest.fixture(scope="module")
def loaded() -> CModel:
    return CModel(paper_subject())


@pytest.fixture(scope="module")
def loaded_float() -> CModel:
    return CModel(paper_subject(), Precision.FLOAT)


BAD_SAMPLES = [(1e308, 6e5, 0.0), (1500.0, -1e308, 0.0), (1500.0, 6e5, np.nan), (1e30, 0.0, 0.0)]


@pytest.mark.parametrize("fixture", ["loaded", "loaded_float"])
@pytest.mark.parametrize("bad", BAD_SAMPLES)
def test_a_run_goes_on_after_a_sample_beyond_any_vehicle(
    request: pytest.FixtureRequest, fixture: str, bad: tuple[float, ...]
) -> None:
    run = pressed_for(request.getfixturevalue(fixture), ("B2",))
    library, layout = run.loaded.library, run.loaded.layout
    delays, line = layout.delays(0.02, 0.005, 0.0), layout.line()
    library.dt_line_begin(*map(ctypes.byref, (line, delays, run.inputs)))
    ends = [(run.inputs, run.inputs), (run.inputs, run.loaded.to_c_inputs(bad))]
    kept = (run.state, line, run.outputs)
    for k, end in enumerate((*ends, *ends, ends[0])):
        before = [bytes(one) for one in kept]
        memory = (run.state, line, run.loaded.params, *end)
        status = library.dt_step_delayed(
            *map(ctypes.byref, memory), 1e-3, ctypes.byref(run.outputs)
        )
        assert STATUS[status] == ("bad state or input" if k % 2 else "completed")
        assert not k % 2 or [bytes(one) for one in kept] == before
    assert np.all(np.isfinite(run.row()))


def test_a_step_that_fails_on_its_way_leaves_the_state(loaded: CModel) -> None:
    run = pressed_for(loaded)
    loaded.params.load_aero = 1.0
    run.state.x[2] = 1e200  # rad/s of the wheel, whose square is no number
    before = [bytes(one) for one in (run.state, run.outputs)]
    assert run.step() != "completed"
    assert [bytes(one) for one in (run.state, run.outputs)] == before


def test_observer_refuses_what_is_not_finite(loaded: CModel) -> None:
    observer = CObserver(loaded, (1000.0, 1e6, 0.0), (150.0, 80.0))
    for row, speed in ((BAD_SAMPLES[0], 150.0), (BAD_SAMPLES[2], 150.0), (BAD_SAMPLES[1], 1e308)):
        with pytest.raises(InputError, match="bad state or input"):
            observer.update_estimates(row, (speed, 80.0), 1e-2)
    with pytest.raises(InputError, match="bad state or input"):
        observer.update_estimates((1000.0, 1e6, 0.0), (150.0, 80.0), 1.0)
