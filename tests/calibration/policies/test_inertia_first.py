# SPDX-License-Identifier: MIT
"""Policy of shifts whose inertia phase comes first: profiles, a start that shifts, what refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.calibration.calibrate import calibrate
from drivetwin.calibration.identified_range import simulate_nominal
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.policies.inertia_first import build_inertia_first_policy
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.table import POLICIES, PolicySetup
from drivetwin.calibration.policy import Space
from drivetwin.calibration.profiles import Profiles
from drivetwin.calibration.torque_balance import estimate_slip_pressures
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.shift_control import ControlledUnit
from tests.calibration.cases import (
    ACTUATOR,
    SYSTEM,
    build_profiles,
    make_draw,
    make_power_off_upshift,
    make_power_on_downshift,
    make_task,
)

SHIFTS = (make_power_on_downshift(), make_power_off_upshift())
SPACES = tuple(Space(build_inertia_first_policy(one, SYSTEM)) for one in SHIFTS)


@settings(deadline=None)
@given(st.sampled_from(SPACES), st.data())
def test_profiles_increase_and_stay_within_limits(space: Space, data: st.DataObject) -> None:
    size = len(space.free)
    shares = data.draw(st.lists(st.floats(0.0, 1.0), min_size=size, max_size=size))
    profiles = build_profiles(space, np.array(shares))
    for signal in profiles.signals.values():
        assert (np.diff(signal.time) > 0.0).all()
        assert signal.time[-1] > SHIFTS[0].horizon
    for signal in (profiles.offgoing, profiles.oncoming):
        assert signal.values.min() >= 0.0
        assert signal.values.max() <= SYSTEM
    assert profiles.offgoing.values[0] == SYSTEM
    assert profiles.oncoming.values[-1] == SYSTEM


@pytest.mark.parametrize("shift", SHIFTS)
def test_start_makes_the_shift(shift: Maneuver) -> None:
    space = Space(build_inertia_first_policy(shift, SYSTEM))
    run = simulate_nominal(shift, build_profiles(space, space.start))
    assert run.status == "completed"
    assert abs(run.slip[shift.oncoming.name][-1]) < 1e-6
    assert run.engine_speed[-1] / run.output_speed[-1] == pytest.approx(shift.ratios[1], rel=1e-6)


@pytest.mark.parametrize("shift", SHIFTS)
def test_the_off_going_element_slips_below_its_balance_alone(shift: Maneuver) -> None:
    """At the pressure of the balance a slipping element keeps the engine in its gear."""
    held = estimate_slip_pressures(shift, SYSTEM).held
    slips = []
    for factor in (1.1, 0.8):
        time = np.array([0.0, shift.request, shift.request + 0.1, shift.horizon + 1.0])
        falling = Signal(time, np.array([SYSTEM, SYSTEM, factor * held, factor * held]))
        ends = time[[0, -1]]
        torque = Signal(ends, np.full(2, shift.point.engine_torque))
        profiles = Profiles(torque, falling, Signal(ends, np.zeros(2)))
        run = simulate_nominal(shift, profiles)
        slips.append(float(run.engine_speed[-1] - shift.ratios[0] * run.output_speed[-1]))
    assert abs(slips[0]) < 1e-6
    assert slips[1] * shift.direction > 5.0


def test_intervention_is_against_the_new_gear() -> None:
    for shift, space in zip(SHIFTS, SPACES, strict=True):
        torque = build_profiles(space, space.start).engine_torque.values
        change = (torque - shift.point.engine_torque) * shift.direction
        assert change.max() == 0.0
        assert change.min() < 0.0


@pytest.mark.parametrize("kind", [PolicyKind.CONTROLLER, PolicyKind.KNOTS])
def test_a_calibration_is_better_than_its_start(kind: PolicyKind) -> None:
    shift = replace(make_power_on_downshift(), step=2e-3)
    base = make_task()
    policy = POLICIES[kind](PolicySetup(shift, SYSTEM, None, 0.01))
    found = calibrate(replace(base, maneuver=shift, policy=policy, draw=make_draw(shift)))
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95 for one in (found.before, found.after)
    )
    assert new < 0.9 * old
    assert found.after.certificate.unlocked == 0


def test_the_slip_loop_is_refused() -> None:
    unit = ControlledUnit(ACTUATOR.model, ACTUATOR.model, 0.05)
    with pytest.raises(InputError, match="torque phase first"):
        POLICIES[PolicyKind.SLIP](PolicySetup(SHIFTS[0], SYSTEM, unit, 0.01))


def test_a_small_system_pressure_is_refused() -> None:
    with pytest.raises(InputError, match=r"system pressure is 1\.00 bar"):
        build_inertia_first_policy(SHIFTS[0], 1e5)
