# SPDX-License-Identifier: MIT
"""Whole drives: standstill, converter, lock-up, shifts of all kinds, with the full gearbox."""

from __future__ import annotations

from drivetwin.drive.load import builtin_powertrains, load_powertrain, suited_powertrain
from drivetwin.drive.plan import (
    Leg,
    LockUp,
    Plan,
    ShiftTo,
    Until,
    Watched,
    all_kinds,
    coast_down,
    launch,
)
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.result import DriveRun
from drivetwin.drive.run import run

__all__ = [
    "DriveRun",
    "Leg",
    "LockUp",
    "Plan",
    "Powertrain",
    "ShiftTo",
    "Until",
    "Watched",
    "all_kinds",
    "builtin_powertrains",
    "coast_down",
    "launch",
    "load_powertrain",
    "run",
    "suited_powertrain",
]
