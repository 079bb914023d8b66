# SPDX-License-Identifier: MIT
"""Sliders: what they start at, what they move, and that the figure is what the run says."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin import Method
from drivetwin.workbench import what_if
from tests.support.arrays import FloatArray


@pytest.fixture
def moved(identified: Any) -> Iterator[Any]:
    """A session whose sliders go back afterwards."""
    identified.choose_method(Method.INTEGRAL)
    yield identified
    identified.choose_method(Method.INTEGRAL)


def test_sliders_stand_where_the_log_said(identified: Any) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    sliders = what_if.list_sliders(twin, shift)
    assert {"eta", "J_out", "J_vehicle", "k_o", "c_o", "te_delay"} <= {one.id for one in sliders}
    assert all(one.low < one.value < one.high for one in sliders)
    assert what_if.collect_changes(sliders, {one.id: one.value for one in sliders}) == {}
    stiffness = next(one for one in sliders if one.id == "k_o")
    found = what_if.collect_changes(sliders, {"k_o": stiffness.value + 2 * stiffness.step})
    assert found["k_o"] == pytest.approx(twin.parameters["k_o"].value, rel=0.1)
    pressure = f"P0.{shift.oncoming}"
    value = next(one.value + 2 * one.step for one in sliders if one.id == pressure)
    assert what_if.collect_changes(sliders, {pressure: value}) == {
        pressure: pytest.approx(1e5 * value)
    }
    unknown = replace(twin.parameters["k_o"], value=None)
    lacking = replace(twin, parameters={**twin.parameters, "k_o": unknown})
    assert "k_o" not in {one.id for one in what_if.list_sliders(lacking, shift)}


@pytest.mark.parametrize("untold", [None, 0.9])
def test_the_inertia_slider_is_that_of_the_models_gear(
    identified: Any, untold: float | None
) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    first, second = (twin.parameters[f"J_prime_{g}"] for g in (shift.start_gear, shift.end_gear))
    large = replace(first, value=20.0, std_noise=1.0, std_systematic=None)
    small = replace(second, value=10.0, std_noise=untold, std_systematic=None)
    changed = replace(twin, parameters={**twin.parameters, large.id: large, small.id: small})
    sliders = what_if.list_sliders(changed, shift)
    assert [one.id for one in sliders if one.id.startswith("J_prime")] == [large.id]


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
        run = what_if.simulate_identified(other, work.require_log(), work.require_shift())
        assert run.fit == present.fit


def test_the_age_of_the_torque_moves_the_torque(moved: Any) -> None:
    told = moved.work.require_twin().get_value("te_delay", 0.0)
    before = moved.get_simulation().present.engine_torque
    moved.apply_sliders({"te_delay": 0.02})
    present = moved.get_simulation().present.engine_torque
    middle = slice(5, -5)
    shifted = before.time[middle] + told - 0.02
    assert np.interp(shifted, present.time, present.values) == pytest.approx(
        before.values[middle], rel=1e-9
    )


def test_the_figure_shows_the_run_and_follows_it(moved: Any) -> None:
    live = moved.get_simulation()
    changes = moved.apply_sliders({"k_o": 1.2e5})
    whole = what_if.plot_what_if(live.identified, moved.get_simulation().present)
    assert {whole.data[k].name for k in changes} == {"simulated", "measured − simulated"}
    for place, change in changes.items():
        assert np.array_equal(whole.data[place].y, _unpack(change["y"]))
        assert np.array_equal(whole.data[place].x, _unpack(change["x"]))


def _unpack(packed: dict[str, str]) -> FloatArray:
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"]).astype(np.float64)
