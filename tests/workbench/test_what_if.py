# SPDX-License-Identifier: MIT
"""Sliders: what they start at, what they move, and that the figure is what the run says."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import MissingParameterError
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from drivetwin.validation.simulate_log import simulate_shift
from drivetwin.workbench.session import Session
from drivetwin.workbench.what_if import (
    build_model,
    collect_changed_curves,
    collect_changes,
    get_display,
    list_sliders,
    plot_what_if,
    simulate_changes,
    simulate_identified,
)
from tests.support.arrays import FloatArray


def test_sliders_stand_where_the_log_said(identified: Session) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    sliders = list_sliders(twin, shift)
    assert {"eta", "J_out", "J_vehicle", "k_o", "c_o", "te_delay"} <= {one.id for one in sliders}
    for one in sliders:
        assert one.low < one.value < one.high
        assert one.low <= (one.high - one.low) * 1e9
        if one.id in twin.parameters:
            value = twin.parameters[one.id].value
            assert value is not None
            assert one.value == pytest.approx(value * get_display(one.id).factor, abs=one.step)


@pytest.mark.parametrize("untold", [None, 0.9])
def test_the_inertia_slider_is_that_of_the_models_gear(
    identified: Session, untold: float | None
) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    first, second = (twin.parameters[f"J_prime_{g}"] for g in (shift.start_gear, shift.end_gear))
    large = replace(first, value=20.0, std_noise=1.0, std_systematic=None)
    small = replace(second, value=10.0, std_noise=untold, std_systematic=None)
    changed = replace(twin, parameters={**twin.parameters, large.id: large, small.id: small})
    (told,) = [one.id for one in list_sliders(changed, shift) if one.id.startswith("J_prime")]
    assert told == large.id
    assert build_model(changed, shift, {told: 20.0}) == build_model(changed, shift, {})


def test_sliders_at_rest_change_nothing(identified: Session) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    sliders = list_sliders(twin, shift)
    assert collect_changes(sliders, {one.id: one.value for one in sliders}) == {}
    moved = {one.id: one.value + 2 * one.step for one in sliders}
    changes = collect_changes(sliders, moved)
    assert set(changes) == {one.id for one in sliders}
    assert changes["P0." + shift.oncoming] == pytest.approx(1e5 * moved["P0." + shift.oncoming])


def test_nothing_changed_is_the_validation(identified: Session) -> None:
    work = identified.work
    twin, log, shift = work.require_twin(), work.require_log(), work.require_shift()
    again = simulate_changes(simulate_identified(twin, log, shift), twin, log, {})
    expected = simulate_shift(twin, log, shift)
    assert np.array_equal(
        again.traces["output_torque"].simulated, expected.traces["output_torque"].simulated
    )
    assert again.fit == expected.fit


@pytest.mark.parametrize(
    ("name", "factor"),
    [("eta", 0.9), ("k_o", 1.3), ("J_vehicle", 1.1), ("Tv_over_if", 0.8), ("mu", 1.1)],
)
def test_a_parameter_moves_the_run_as_a_new_model_would(
    identified: Session, name: str, factor: float
) -> None:
    work = identified.work
    twin, log, shift = work.require_twin(), work.require_log(), work.require_shift()
    if name == "mu":
        name = f"mu.{shift.oncoming}"
        value = factor
    else:
        told = twin.parameters[name].value
        assert told is not None
        value = told * factor
    before = simulate_identified(twin, log, shift)
    present = simulate_changes(before, twin, log, {name: value})
    expected = simulate_shift(twin, log, shift, build_model(twin, shift, {name: value}))
    assert present.fit == expected.fit
    assert present.fit != before.fit


def test_the_age_of_the_torque_moves_the_torque(identified: Session) -> None:
    work = identified.work
    twin, log, shift = work.require_twin(), work.require_log(), work.require_shift()
    before = simulate_identified(twin, log, shift)
    present = simulate_changes(before, twin, log, {"te_delay": 0.02})
    told = twin.get_value("te_delay", 0.0)
    middle = slice(5, -5)
    shifted = before.engine_torque.time[middle] + told - 0.02
    assert np.interp(
        shifted, present.engine_torque.time, present.engine_torque.values
    ) == pytest.approx(before.engine_torque.values[middle], rel=1e-9)


def test_friction_is_scaled_whatever_its_law(identified: Session) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    name = shift.oncoming
    slip = np.array([0.0, 10.0, 60.0])
    plain, scaled = (
        next(e for e in build_model(twin, shift, {f"mu.{name}": f}).elements if e.name == name)
        for f in (1.0, 1.2)
    )
    assert scaled.friction.evaluate(slip) == pytest.approx(1.2 * plain.friction.evaluate(slip))
    without = {k: replace(c, stribeck=None) for k, c in twin.friction.items()}
    table = build_model(replace(twin, friction=without), shift, {f"mu.{name}": 1.2})
    law = next(e for e in table.elements if e.name == name).friction
    assert isinstance(law, FrictionTable)
    assert isinstance(plain.friction, Stribeck)


def test_the_figure_shows_the_run_and_follows_it(identified: Session) -> None:
    work = identified.work
    twin, log, shift = work.require_twin(), work.require_log(), work.require_shift()
    before = simulate_identified(twin, log, shift)
    present = simulate_changes(before, twin, log, {"k_o": 1.2e5})
    moved = collect_changed_curves(plot_what_if(before, before), present)
    whole = plot_what_if(before, present)
    assert {whole.data[k].name for k in moved} == {"simulated", "measured − simulated"}
    for place, change in moved.items():
        assert np.array_equal(whole.data[place].y, _unpacked(change["y"]))
        assert np.array_equal(whole.data[place].x, _unpacked(change["x"]))


def _unpacked(packed: dict[str, str]) -> FloatArray:
    return np.frombuffer(base64.b64decode(packed["bdata"]), packed["dtype"]).astype(np.float64)


def test_what_the_log_could_not_tell_is_named(identified: Session) -> None:
    twin, shift = identified.work.require_twin(), identified.work.require_shift()
    unknown = replace(twin.parameters["k_o"], value=None)
    twin = replace(twin, parameters={**twin.parameters, "k_o": unknown})
    assert "k_o" not in {one.id for one in list_sliders(twin, shift)}
    with pytest.raises(MissingParameterError, match="k_o"):
        build_model(twin, shift, {})
    assert build_model(twin, shift, {"k_o": 1.5e5}).k_o == 1.5e5
