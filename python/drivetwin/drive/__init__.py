# SPDX-License-Identifier: MIT
"""Whole drives: standstill, converter, lock-up, shifts of all kinds, with the full gearbox."""

from __future__ import annotations

from drivetwin.drive.dogs import run
from drivetwin.drive.plan import (
    Leg,
    LockUp,
    Plan,
    ShiftTo,
    Until,
    Watched,
    plan_all_shift_kinds,
    plan_coast_down,
    plan_launch,
)
from drivetwin.drive.powertrain import (
    Powertrain,
    list_builtin_powertrains,
    load_powertrain,
    select_powertrain,
)
from drivetwin.drive.result import DriveRun

__all__ = [
    "DriveRun",
    "Leg",
    "LockUp",
    "Plan",
    "Powertrain",
    "ShiftTo",
    "Until",
    "Watched",
    "list_builtin_powertrains",
    "load_powertrain",
    "plan_all_shift_kinds",
    "plan_coast_down",
    "plan_launch",
    "run",
    "select_powertrain",
]
