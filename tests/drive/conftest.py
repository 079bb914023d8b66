# SPDX-License-Identifier: MIT
"""One drive with all four kinds of shift for all tests of drives."""

from __future__ import annotations

import pytest

from drivetwin.drive import DriveRun, Powertrain, load_powertrain, plan_all_shift_kinds, run
from drivetwin.gearbox import Gearbox, load_gearbox


@pytest.fixture(scope="session")
def gearbox() -> Gearbox:
    """The three-set six-speed of a heavy truck."""
    return load_gearbox("three-set-4000cr")


@pytest.fixture(scope="session")
def truck() -> Powertrain:
    """The powertrain for it."""
    return load_powertrain("truck-324kw")


@pytest.fixture(scope="session")
def drive(gearbox: Gearbox, truck: Powertrain) -> DriveRun:
    """Launch to sixth gear, kick-down, up-shift with closed pedal, coast-down."""
    return run(gearbox, truck, plan_all_shift_kinds(gearbox, truck.control))
