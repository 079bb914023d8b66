# SPDX-License-Identifier: MIT
"""Gearboxes as data: cards, the speeds and torques of their gears, shifts as a dual clutch."""

from __future__ import annotations

from drivetwin.gearbox.card import list_builtin_gearboxes, load_gearbox
from drivetwin.gearbox.compare import Comparison, compare
from drivetwin.gearbox.maneuver import (
    CouplingError,
    GearStatics,
    describe_ratio_differences,
    solve_gear,
)
from drivetwin.gearbox.reduction import Reduction, build_network_elements, reduce
from drivetwin.gearbox.spec import Drive, Gearbox

__all__ = [
    "Comparison",
    "CouplingError",
    "Drive",
    "GearStatics",
    "Gearbox",
    "Reduction",
    "build_network_elements",
    "compare",
    "describe_ratio_differences",
    "list_builtin_gearboxes",
    "load_gearbox",
    "reduce",
    "solve_gear",
]
