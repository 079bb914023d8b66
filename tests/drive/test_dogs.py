# SPDX-License-Identifier: MIT
"""Gearboxes with dogs: synchronisers, interrupted shifts, preselection, launch."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from drivetwin.drive import (
    DriveRun,
    Leg,
    LockUp,
    Plan,
    ShiftTo,
    Until,
    Watched,
    load_powertrain,
    plan_all_shift_kinds,
    plan_launch,
    run,
)
from drivetwin.drive.dogs import split_gear
from drivetwin.errors import InputError, SimulationError
from drivetwin.gearbox import Gearbox, build_network_elements, load_gearbox, solve_gear
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output, Start, build_element, simulate
from drivetwin.vehicle.spec import ShiftKind

CAR = load_powertrain("car-350nm")
NAMES = ("manual-6", "dual-clutch-7")


@pytest.fixture(scope="module", params=NAMES)
def box(request: pytest.FixtureRequest) -> Gearbox:
    return load_gearbox(request.param)


@pytest.fixture(scope="module")
def driven(box: Gearbox) -> DriveRun:
    return run(box, CAR, plan_all_shift_kinds(box, CAR.control))


def test_every_gear_is_reached_at_its_ratio(box: Gearbox, driven: DriveRun) -> None:
    shifts = [each.action for each in driven.maneuvers if each.action.kind in list(ShiftKind)]
    forward = {gear.name for gear in box.gears if solve_gear(box, gear.name).ratio > 0.0}
    assert {action.label.partition("→")[2] for action in shifts} >= forward - {"1"}
    for action in shifts:
        gear = action.label.partition("→")[2]
        at = np.searchsorted(driven.time, action.end)
        ratio = driven.engine_speed[at] / driven.output_speed[at]
        assert ratio == pytest.approx(solve_gear(box, gear).ratio, rel=1e-9)
    assert {action.kind for action in shifts} == {
        kind for kind in ShiftKind if "unknown" not in kind.value
    }


def test_energy_closes(driven: DriveRun) -> None:
    assert abs(driven.audit.error) < 1e-8 * driven.audit.source
    assert driven.audit.impulse == 0.0
    assert driven.converter is None
    assert driven.warnings == ()


def test_dogs_engage_without_slip_and_hold(box: Gearbox, driven: DriveRun) -> None:
    """From its lock to its release a dog has no slip; it locks while its torque is the cone's."""
    for dog in box.dogs:
        states = [event for event in driven.events if event.element == dog]
        for event, after in pairwise(states):
            if event.kind == "lock":
                assert after.kind == "break_away"
                inside = (driven.time > event.time) & (driven.time < after.time)
                assert np.abs(driven.slip[dog][inside]).max() < 1e-9  # round-off
                at = np.searchsorted(driven.time, event.time)
                assert abs(driven.torque[dog][at - 1]) < 1e3  # N m


def test_a_manual_gearbox_interrupts_the_torque_and_a_dual_clutch_does_not(
    box: Gearbox, driven: DriveRun
) -> None:
    shift = next(each.action for each in driven.maneuvers if each.action.label == "3→4")
    inside = (driven.time > shift.start) & (driven.time < shift.end)
    clutches = [name for name in box.elements if name not in box.dogs]
    carried = np.sum([np.abs(driven.torque[name][inside]) for name in clutches], axis=0)
    if box.name == load_gearbox("manual-6").name:
        assert carried.min() == 0.0
        assert shift.off_going == shift.on_coming == "K"
    else:
        assert carried.min() > 100.0


def test_the_clutch_takes_what_the_engine_loses_in_a_launch(box: Gearbox, driven: DriveRun) -> None:
    """J·Δω of the crankshaft is the integral of engine torque less clutch torque."""
    launch = next(each.action for each in driven.maneuvers if each.action.label == "launch")
    span = slice(*np.searchsorted(driven.time, (launch.start, launch.end)))
    clutch = split_gear(box, "1").clutch
    net = driven.engine_torque[span] - driven.torque[clutch][span]
    inertia = box.require_drive().engine_inertia + box.inertias["engine"]
    speed = driven.engine_speed[span]
    gained = np.trapezoid(net, driven.time[span]) / inertia
    assert gained == pytest.approx(speed[-1] - speed[0], abs=0.1)


def test_a_dog_is_not_engaged_with_slip() -> None:
    """A synchroniser paced for a minute does not end within the time of a shift."""
    box = load_gearbox("manual-6")
    slow = replace(box, drive=replace(box.require_drive(), inertia_phase=60.0))
    with pytest.raises(SimulationError, match="engages without slip alone"):
        run(slow, CAR, plan_launch(slow, CAR.control))


def test_a_dog_forced_at_a_speed_difference_gives_the_impulse() -> None:
    """Two free inertias: momentum stays, ½·J1·J2/(J1 + J2)·Δω² becomes heat."""
    box = load_gearbox("manual-6")
    dog = next(one for one in build_network_elements(box) if one["name"] == "D2")
    a, b, first, second = "wheel 2", "output shaft", 0.3, 0.9
    elements = [
        build_element("inertia", "1", node=a, inertia=first),
        build_element("inertia", "2", node=b, inertia=second),
        dog,
    ]
    time = np.linspace(0.0, 0.2, 201)
    inputs = {"D2": Signal(np.array([0.0, 0.1, 0.1001, 0.2]), np.array([0.0, 0.0, 1e6, 1e6]))}
    outputs: list[Output] = [("speed", a), ("speed", b), ("heat", "D2")]
    found = simulate(elements, inputs, Start({a: 200.0, b: 40.0}), time, outputs).columns
    common = (first * 200.0 + second * 40.0) / (first + second)
    assert found["speed", a][-1] == pytest.approx(common, rel=1e-9)
    assert found["speed", b][-1] == pytest.approx(common, rel=1e-9)
    heat = 0.5 * first * second / (first + second) * 160.0**2
    assert abs(found["heat", "D2"][-1]) == pytest.approx(heat, rel=1e-6)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ((Leg(0.5, Until(Watched.TIME, 0.5), ShiftTo("R")),), "not a forward gear"),
        (
            (Leg(0.5, Until(Watched.SPEED_RATIO, 0.8), LockUp(closed=True)),),
            "there is no converter",
        ),
    ],
)
def test_plans_that_no_dog_gearbox_can_drive_are_refused(plan: Plan, words: str) -> None:
    with pytest.raises(InputError, match=words):
        run(load_gearbox("manual-6"), CAR, plan)


def test_a_gear_without_starting_clutch_is_refused() -> None:
    box = load_gearbox("manual-6")
    gears = tuple(replace(gear, elements=gear.elements[1:]) for gear in box.gears)
    with pytest.raises(InputError, match="has dogs"):
        split_gear(replace(box, gears=gears), "1")


def test_two_gears_on_one_clutch_of_a_dual_clutch_gearbox_interrupt_the_torque() -> None:
    """Second to fourth gear: both on K2."""
    box = load_gearbox("dual-clutch-7")
    *launch, last = plan_launch(box, CAR.control)[:4]
    plan = (*launch, replace(last, then=ShiftTo("4")), Leg(0.8, Until(Watched.TIME, 1.0)))
    motion = run(box, CAR, plan)
    action = next(each.action for each in motion.maneuvers if each.action.label == "2→4")
    assert action.off_going == action.on_coming == "K2"
    ratio = motion.engine_speed[-1] / motion.output_speed[-1]
    assert ratio == pytest.approx(solve_gear(box, "4").ratio, rel=1e-9)
