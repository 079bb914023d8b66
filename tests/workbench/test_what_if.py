# SPDX-License-Identifier: MIT
"""Sliders: what they start at, what they move, and that the figure is what the run says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.workbench.what_if import simulate_identified


@pytest.fixture
def moved(identified: Any) -> Iterator[Any]:
    """A session whose sliders go back afterwards."""
    identified.update(lambda work: replace(work, changes={}))
    yield identified
    identified.update(lambda work: replace(work, changes={}))


def test_at_rest_the_run_is_that_of_the_identification(moved: Any) -> None:
    live = moved.get_simulation()
    moved.apply_sliders({})
    again = moved.get_simulation().present
    one, other = (run.traces["output_torque"].simulated for run in (live.identified, again))
    assert np.array_equal(one, other)
    assert again.fit == live.identified.fit
    stated = moved.work.require_outcome().found.fit["output_torque"]["all"].fit_percent
    assert again.fit["output_torque"]["all"].fit_percent == pytest.approx(stated)


@pytest.mark.parametrize(
    ("name", "factor"),
    [("eta", 0.9), ("k_o", 1.3), ("J_vehicle", 1.1), ("Tv_over_if", 0.8), ("mu", 1.1)],
)
def test_a_parameter_moves_the_run_as_another_twin_would(
    moved: Any, name: str, factor: float
) -> None:
    work = moved.work
    twin = work.require_twin()
    if name == "mu":
        name, value = f"mu.{work.require_shift().oncoming}", factor
    else:
        value = twin.parameters[name].value * factor
    before = moved.get_simulation().present.fit
    moved.apply_sliders({name: value})
    present = moved.get_simulation().present
    assert present.fit != before
    if not name.startswith("mu."):
        entry = replace(twin.parameters[name], value=value)
        other = replace(twin, parameters={**twin.parameters, name: entry})
        run = simulate_identified(other, work.require_log(), work.require_shift())
        assert run.fit == present.fit


def test_the_age_of_the_torque_moves_the_torque(moved: Any) -> None:
    reported = moved.work.require_twin().get_value("te_delay", 0.0)
    before = moved.get_simulation().present.engine_torque
    moved.apply_sliders({"te_delay": 0.02})
    present = moved.get_simulation().present.engine_torque
    middle = slice(5, -5)
    shifted = before.time[middle] + reported - 0.02
    assert np.interp(shifted, present.time, present.values) == pytest.approx(
        before.values[middle], rel=1e-9
    )
