# SPDX-License-Identifier: MIT
"""Gearboxes as data: cards, the speeds and torques of their gears, shifts as a dual clutch."""

from __future__ import annotations

from drivetwin.gearbox.card import builtin_gearboxes, gearbox_schema, load_gearbox
from drivetwin.gearbox.gears import GearStatics, gear_statics
from drivetwin.gearbox.reduction import Reduction, reduce
from drivetwin.gearbox.spec import Gearbox

__all__ = [
    "GearStatics",
    "Gearbox",
    "Reduction",
    "builtin_gearboxes",
    "gear_statics",
    "gearbox_schema",
    "load_gearbox",
    "reduce",
]
