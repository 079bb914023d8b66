# SPDX-License-Identifier: MIT
"""Built-in plans go through all gears of any card."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from drivetwin.drive import (
    Leg,
    LockUp,
    Powertrain,
    ShiftTo,
    Until,
    Watched,
    plan_all_shift_kinds,
    plan_coast_down,
    plan_launch,
)
from drivetwin.errors import InputError
from drivetwin.gearbox import Gearbox, load_gearbox, solve_gear


@pytest.mark.parametrize("name", ["three-set-3000", "simpson-3", "zf-8hp70"])
def test_all_gears_are_driven_up_and_down(name: str, truck: Powertrain) -> None:
    box = load_gearbox(name)
    ratios = {gear.name: solve_gear(box, gear.name).ratio for gear in box.gears}
    gears = sorted((name for name in ratios if ratios[name] > 0.0), key=lambda g: -ratios[g])
    up = [leg.then.gear for leg in plan_launch(box, truck.control) if isinstance(leg.then, ShiftTo)]
    down = [
        leg.then.gear
        for leg in plan_coast_down(box, truck.control)
        if isinstance(leg.then, ShiftTo)
    ]
    assert up == gears[1:]
    assert down == gears[-2::-1]


def test_lock_up_closes_once_and_opens_once(gearbox: Gearbox, truck: Powertrain) -> None:
    moves = [
        leg.then
        for leg in plan_all_shift_kinds(gearbox, truck.control)
        if isinstance(leg.then, LockUp)
    ]
    assert moves == [LockUp(closed=True), LockUp(closed=False)]


def test_too_few_gears_are_refused(gearbox: Gearbox, truck: Powertrain) -> None:
    short = replace(gearbox, gears=gearbox.gears[:2])
    with pytest.raises(InputError, match="has 2 forward gears"):
        plan_launch(short, truck.control)


@pytest.mark.parametrize("time", [0.0, -1.0, 600.0, math.nan])
def test_a_time_that_no_leg_takes_is_refused(time: float) -> None:
    with pytest.raises(InputError, match=r"a leg of .*\n.*up to 240 s, or several legs"):
        Until(Watched.TIME, time)


@pytest.mark.parametrize(
    ("pedal", "brake", "message"),
    [
        (1.1, 0.0, "a pedal at 1.1"),
        (-0.1, 0.0, "a pedal at -0.1"),
        (math.nan, 0.0, "a pedal at nan"),
        (0.0, -5.0, "a service brake of -5 N m"),
        (0.0, math.inf, "a service brake of inf N m"),
    ],
)
def test_a_pedal_or_brake_that_there_is_not_is_refused(
    pedal: float, brake: float, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        Leg(pedal, Until(Watched.TIME, 1.0), brake=brake)
