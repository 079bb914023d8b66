# SPDX-License-Identifier: MIT
"""Knots: the profile passes through them, whatever their values."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.calibration.controller_policy import build_controller_policy
from drivetwin.calibration.knot_policy import build_knot_policy
from drivetwin.calibration.maneuver import Maneuver
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
    for one, signal, origin in (
        (policy.oncoming, profiles.oncoming, start.oncoming),
        (policy.offgoing, profiles.offgoing, start.offgoing),
        (policy.engine_torque, profiles.engine_torque, start.engine_torque),
    ):
        at = np.interp(one.times, signal.time, signal.values)
        assert at == pytest.approx(np.interp(one.times, origin.time, origin.values))
        assert (np.diff(signal.time) > 0.0).all()
    moved = policy.set_start({"oncoming_pressure_3": 2e5, "engine_torque_1": 0.0})
    assert moved.oncoming.start[2] == 2e5
    assert moved.parameters[12].start == pytest.approx(moved.engine_torque.start[0])
