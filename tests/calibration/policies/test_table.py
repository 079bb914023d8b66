# SPDX-License-Identifier: MIT
"""One contract for every registered policy, on every kind of shift that it makes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.torque_balance import estimate_slip_pressures
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from tests.calibration.cases import (
    SHIFTS,
    SYSTEM,
    draw,
    make_plant,
    make_task,
    run_nominal,
    start,
    start_profiles,
)
from tests.calibration.twins import ACTUATOR, make_hydraulic_twin

INERTIA_FIRST = ("power-on downshift", "power-off upshift")
MADE = [
    (kind, name)
    for kind in PolicyKind
    if kind is not PolicyKind.OWN  # `test_own` has it: it needs a controller in C
    for name in SHIFTS
    if kind is not PolicyKind.SLIP or name not in INERTIA_FIRST
]
TASKS: dict[tuple[PolicyKind, str], Any] = {
    (kind, name): make_task(**SHIFTS[name], policy=kind) for kind, name in MADE
}
every = pytest.mark.parametrize(("kind", "name"), MADE)
OPEN = [one for key, one in TASKS.items() if not key[0].commands_actuators]


@every
def test_start_makes_the_shift(kind: PolicyKind, name: str) -> None:
    task = TASKS[kind, name]
    assert task.maneuver.inertia_first == (name in INERTIA_FIRST)
    torque, old, _, _, slip = run_nominal(task, start(task))
    assert np.isfinite(torque).all()
    assert abs(slip[-1]) < 1e-6
    assert abs(old[-1]) < 1.0


@every
def test_the_intervention_brakes_or_helps_the_engine(kind: PolicyKind, name: str) -> None:
    """Towards the speed of the new gear; against it where the engine moves there by itself."""
    task = TASKS[kind, name]
    shift, torque = task.maneuver, start_profiles(task).engine_torque.values
    change = (torque - shift.point.engine_torque) * shift.direction
    if name in INERTIA_FIRST:
        change = -change
    assert change.min() == pytest.approx(0.0, abs=1e-9)
    assert change.max() > 0.0


@given(st.sampled_from(OPEN), st.data())
def test_profiles_increase_and_stay_within_limits(task: Any, data: st.DataObject) -> None:
    values = [data.draw(st.floats(one.low, one.high)) for one in task.policy.parameters]
    profiles = task.policy.build_control(np.array(values))
    for signal in profiles.signals.values():
        assert (np.diff(signal.time) > 0.0).all()
        assert signal.time[0] == 0.0
        assert signal.time[-1] >= task.maneuver.horizon
    for signal in (profiles.offgoing, profiles.oncoming):
        assert signal.values.min() >= 0.0
        assert signal.values.max() <= SYSTEM
    assert profiles.offgoing.values[0] == SYSTEM
    assert profiles.oncoming.values[-1] == SYSTEM


@every
def test_starts_and_bounds_by_name(kind: PolicyKind, name: str) -> None:
    one = next(one for one in TASKS[kind, name].policy.parameters if one.free)
    low, high = one.low, 0.5 * (one.low + one.high)
    for bounds, begin, expected, free in (
        ({}, 0.9 * low + 0.1 * high, 0.9 * low + 0.1 * high, True),
        ({}, one.high + abs(one.high), one.high, True),
        ({one.name: (low, high)}, one.high, high, True),
        ({one.name: (high, high)}, high, high, False),
    ):
        task = make_task(**SHIFTS[name], policy=kind, bounds=bounds, start={one.name: begin})
        found = next(each for each in task.policy.parameters if each.name == one.name)
        assert found.start == pytest.approx(expected)
        assert found.free is free
    for wrong in ({"start": {"wrong": 0.1}}, {"bounds": {"wrong": (0.0, 1.0)}}):
        with pytest.raises(InputError, match="no parameter wrong"):
            make_task(**SHIFTS[name], policy=kind, **wrong)
    with pytest.raises(InputError, match="bounds"):
        make_task(**SHIFTS[name], policy=kind, bounds={one.name: (high, low)})


@every
def test_values_at_a_bound_are_listed(kind: PolicyKind, name: str) -> None:
    policy = TASKS[kind, name].policy
    middle = np.array([0.5 * (one.low + one.high) for one in policy.parameters])
    assert policy.list_at_bounds(middle) == []
    place = next(k for k, one in enumerate(policy.parameters) if one.free)
    middle[place] = policy.parameters[place].high
    ((found, end),) = policy.list_at_bounds(middle)
    assert (found.name, end) == (policy.parameters[place].name, middle[place])


@every
def test_a_system_pressure_that_carries_too_little_is_refused(kind: PolicyKind, name: str) -> None:
    with pytest.raises(InputError, match=r"in this shift, the system pressure is 0\.5"):
        make_task(**SHIFTS[name], policy=kind, system_pressure=0.5e5)


def test_a_policy_refuses_the_shift_that_it_cannot_make() -> None:
    with pytest.raises(InputError, match="torque phase first"):
        make_task(**SHIFTS["power-on downshift"], policy=PolicyKind.SLIP)
    with pytest.raises(InputError, match="needs a controller"):
        make_task(policy=PolicyKind.OWN)


@pytest.mark.parametrize("name", INERTIA_FIRST)
def test_the_off_going_element_slips_below_its_balance_alone(name: str) -> None:
    """At the pressure of the balance a slipping element keeps the engine in its gear."""
    task = TASKS[PolicyKind.CONTROLLER, name]
    shift, control = task.maneuver, start_profiles(task)
    held = estimate_slip_pressures(shift, SYSTEM).held
    slips = []
    for factor in (1.1, 0.8):
        time = np.array([0.0, shift.request, shift.request + 0.1, shift.horizon + 1.0])
        falling = Signal(time, np.array([SYSTEM, SYSTEM, factor * held, factor * held]))
        ends = time[[0, -1]]
        torque = Signal(ends, np.full(2, shift.point.engine_torque))
        profiles = type(control)(torque, falling, Signal(ends, np.zeros(2)))
        slips.append(float(run_nominal(task, profiles)[2][-1]))
    assert abs(slips[0]) < 1e-6
    assert abs(slips[1]) > 3.0


def test_the_slip_loop_holds_its_reference_over_the_spread() -> None:
    twin = replace(make_hydraulic_twin(), actuators={"B2": ACTUATOR, "B3": ACTUATOR})
    task = make_task(policy=PolicyKind.SLIP, twin=twin)
    draws, spreads = draw(task, 12), []
    for share in (0.0, 1.0):
        gains = {"gain": share * 4.0, "integral_gain": share * 4.0}
        values = [gains.get(one.name, 1.0) * one.start for one in task.policy.parameters]
        control = task.policy.build_control(np.array(values))
        outcome = make_plant(task.maneuver).evaluate(control, draws)
        spreads.append(float(outcome.values[Metric.SHIFT_TIME].std()))
    assert spreads[1] < 0.8 * spreads[0]
