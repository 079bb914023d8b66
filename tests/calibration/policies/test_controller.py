# SPDX-License-Identifier: MIT
"""Controller policy: profiles for any parameters, a start that shifts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.calibration.identified_range import simulate_nominal
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policy import Space
from drivetwin.errors import InputError
from tests.calibration.cases import SYSTEM, build_profiles, make_downshift, make_upshift

SHIFTS = (make_upshift(), make_downshift())
SPACES = tuple(Space(build_controller_policy(one, SYSTEM)) for one in SHIFTS)


@settings(deadline=None)
@given(st.sampled_from(SPACES), st.data())
def test_profiles_increase_and_stay_within_limits(space: Space, data: st.DataObject) -> None:
    size = len(space.free)
    shares = data.draw(st.lists(st.floats(0.0, 1.0), min_size=size, max_size=size))
    profiles = build_profiles(space, np.array(shares))
    for signal in profiles.signals.values():
        assert (np.diff(signal.time) > 0.0).all()
        assert signal.time[0] == 0.0
        assert signal.time[-1] > SHIFTS[0].horizon
    for signal in (profiles.offgoing, profiles.oncoming):
        assert signal.values.min() >= 0.0
        assert signal.values.max() <= SYSTEM
    assert profiles.offgoing.values[0] == SYSTEM
    assert profiles.oncoming.values[-1] == SYSTEM


@pytest.mark.parametrize("shift", SHIFTS)
def test_start_makes_the_shift(shift: Maneuver) -> None:
    space = Space(build_controller_policy(shift, SYSTEM))
    run = simulate_nominal(shift, build_profiles(space, space.start))
    assert run.status == "completed"
    assert abs(run.slip[shift.oncoming.name][-1]) < 1e-6
    assert run.engine_speed[-1] / run.output_speed[-1] == pytest.approx(shift.ratios[1], rel=1e-6)


def test_intervention_is_towards_the_new_gear() -> None:
    for shift, space in zip(SHIFTS, SPACES, strict=True):
        torque = build_profiles(space, space.start).engine_torque.values
        change = (torque - shift.point.engine_torque) * shift.direction
        assert change.min() == 0.0
        assert change.max() > 0.0


def test_a_small_system_pressure_is_refused() -> None:
    with pytest.raises(InputError, match=r"system pressure is 3\.00 bar"):
        build_controller_policy(make_upshift(), 3e5)
