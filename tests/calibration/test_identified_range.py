# SPDX-License-Identifier: MIT
"""Findings outside the identified range, with their time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.calibration.identified_range import check_identified_range
from drivetwin.calibration.policy import Space
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.findings import Code
from tests.calibration.cases import build_profiles
from tests.calibration.twins import make_twin


def test_says_what_leaves_the_range_and_when() -> None:
    base = make_twin()
    twin = replace(base, validity={**base.validity, "speed": (60.0, 200.0)})
    task = build_task(twin, Request(gears=("2", "3"), limits=()))
    space = Space(task.policy)
    profiles = build_profiles(space, space.start)
    assert check_identified_range(twin, task.maneuver, profiles) == ()
    narrow = replace(twin, validity={**twin.validity, "torque": (1150.0, 1500.0)})
    (found,) = check_identified_range(narrow, task.maneuver, profiles)
    assert found.code is Code.OUTSIDE_IDENTIFIED_RANGE
    assert found.subject == "torque"
    torque = profiles.engine_torque
    first = torque.time[np.argmin(torque.values)] - task.maneuver.request
    assert found.place.time == first
