# SPDX-License-Identifier: MIT
"""Draws: reproducible, of the stated spread, the same runs as with the changed models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.calibrate import draw_for
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import (
    Draw,
    Purpose,
    collect_scenarios,
    draw_scenarios,
    is_possible,
    scale_units,
)
from drivetwin.calibration.spread import Spread
from drivetwin.errors import InputError
from drivetwin.simulation.driveline import Driveline
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import FrictionTable, Signal
from drivetwin.twin.distribution import scale_friction
from tests.calibration.cases import (
    SYSTEM,
    build_profiles,
    make_draw,
    make_draws,
    make_plant,
    make_slip_task,
    make_upshift,
)


def test_draws_follow_seed_and_purpose() -> None:
    shift = make_upshift()
    draw = make_draw(shift)
    first, again = (draw_scenarios(shift, draw, 8, 3, Purpose.POLISH) for _ in range(2))
    other = draw_scenarios(shift, draw, 8, 3, Purpose.CERTIFICATE)
    for name, values in first.sets.items():
        assert (values == again.sets[name]).all()
        assert (values != other.sets[name]).any()


def test_draws_have_the_stated_spread() -> None:
    shift = make_upshift()
    sets = make_draws(shift, 3000).sets
    gain = sets["3.gain"] / shift.oncoming.gain
    assert gain.std() == pytest.approx(0.025, rel=0.06)
    assert sets["i_in.loss.eta"].std() / shift.model.eta == pytest.approx(0.015, rel=0.06)
    assert sets["2.p0"].std() == pytest.approx(5e3, rel=0.06)
    assert (sets["2.p0"] - shift.offgoing.P0) == pytest.approx(sets["3.p0"] - shift.oncoming.P0)


def test_a_torque_scale_is_a_scale_of_the_torque() -> None:
    shift = make_upshift()
    space = Space(build_controller_policy(shift, SYSTEM))
    profiles = build_profiles(space, space.start)
    unit = scale_units(shift.model, Spread(0.0, 0.05, 0.0), np.random.default_rng(2))
    scale = unit.eta / shift.model.eta
    louder = replace(shift, point=replace(shift.point, engine_torque=1400.0 * scale))
    torque = Signal(profiles.engine_torque.time, scale * profiles.engine_torque.values)
    pressures = {"2": profiles.offgoing, "3": profiles.oncoming}
    exact = simulate(shift.model, torque, pressures, louder.build_start(), shift.time)
    drawn = collect_scenarios(shift, [Driveline(unit)])
    columns = make_plant(shift).simulate(profiles, drawn, (shift.body.drive,)).columns
    largest = np.abs(exact.shaft_torque).max()
    assert columns[0, 0] == pytest.approx(exact.shaft_torque, abs=1e-5 * largest)


def test_friction_of_a_table_is_scaled() -> None:
    element = replace(make_upshift().oncoming, friction=FrictionTable((0.0, 10.0), (0.125, 0.25)))
    assert scale_friction(element, 2.0).friction == FrictionTable((0.0, 10.0), (0.25, 0.5))


def test_impossible_draws_are_not_run() -> None:
    shift = make_upshift()
    assert not is_possible(replace(shift.model, J_out=-1.0))
    impossible = Driveline(replace(shift.model, k_o=-1.0))
    with pytest.raises(InputError, match="0 of 100 drawn drivelines"):
        draw_scenarios(shift, Draw(lambda _: lambda _: impossible), 5, 1, Purpose.SEARCH)


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_a_spread_is_finite_and_not_negative(value: float) -> None:
    with pytest.raises(InputError, match="spread of gain"):
        Spread(gain=value)


def test_selected_and_joined_scenarios_keep_their_units() -> None:
    drawn = draw_for(make_slip_task(), 6, Purpose.TAIL)
    odd = np.arange(6) % 2 == 1
    both = drawn.select(odd).join(drawn.select(~odd))
    order = [1, 3, 5, 0, 2, 4]
    assert both.count == 6
    assert [drawn.units[k] for k in order] == list(both.units)
    for name, values in drawn.sets.items():
        assert np.array_equal(both.sets[name], values[order])
