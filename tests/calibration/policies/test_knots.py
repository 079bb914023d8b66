# SPDX-License-Identifier: MIT
"""Knots: the profile passes through them, whatever their values."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.knots import build_knot_policy
from drivetwin.calibration.policy import Space
from tests.calibration.cases import SYSTEM, build_profiles, make_downshift, make_upshift


@pytest.mark.parametrize("shift", [make_upshift(), make_downshift()])
def test_knots_lie_on_the_start_and_pass_through_values(
    shift: Maneuver,
) -> None:
    space = Space(build_controller_policy(shift, SYSTEM))
    start = build_profiles(space, space.start)
    policy = build_knot_policy(shift, start, SYSTEM)
    values = np.array([one.start for one in policy.parameters])
    profiles = policy.build_control(values)
    oncoming, offgoing, torque = policy.profiles
    for one, signal, origin in (
        (oncoming, profiles.oncoming, start.oncoming),
        (offgoing, profiles.offgoing, start.offgoing),
        (torque, profiles.engine_torque, start.engine_torque),
    ):
        at = np.interp(one.times, signal.time, signal.values)
        assert at == pytest.approx(np.interp(one.times, origin.time, origin.values))
        assert (np.diff(signal.time) > 0.0).all()
    moved = policy.set_start({"oncoming_pressure_3": 2e5, "engine_torque_1": 0.0})
    assert moved.parameters[2].start == 2e5
    assert moved.parameters[12].name == "engine_torque_1"
    assert moved.parameters[12].start in (moved.parameters[12].low, moved.parameters[12].high)
