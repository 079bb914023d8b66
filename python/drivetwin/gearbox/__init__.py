# SPDX-License-Identifier: MIT
"""Gearboxes as data: cards, the speeds and torques of their gears, shifts as a dual clutch."""

from __future__ import annotations

from drivetwin.gearbox.card import builtin_gearboxes, load_gearbox
from drivetwin.gearbox.compare import Comparison, compare
from drivetwin.gearbox.drive import Drive
from drivetwin.gearbox.estimate import estimate
from drivetwin.gearbox.gears import GearStatics, gear_statics, ratio_remarks
from drivetwin.gearbox.network import network_elements
from drivetwin.gearbox.reduction import Reduction, reduce
from drivetwin.gearbox.spec import Gearbox
from drivetwin.gearbox.traces import CouplingError

__all__ = [
    "Comparison",
    "CouplingError",
    "Drive",
    "GearStatics",
    "Gearbox",
    "Reduction",
    "builtin_gearboxes",
    "compare",
    "estimate",
    "gear_statics",
    "load_gearbox",
    "network_elements",
    "ratio_remarks",
    "reduce",
]
