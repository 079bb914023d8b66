# SPDX-License-Identifier: MIT
"""Unit definitions of FMI: base units and display units."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable

from drivetwin.channels.units import BAR, RPM
from drivetwin.export.parameters.units import parse_base_units

_DISPLAY = {"rad/s": ("rpm", 1.0 / RPM), "Pa": ("bar", 1.0 / BAR), "rad": ("deg", 180.0 / math.pi)}
"""SI unit -> display unit and its factor: displayed = factor · value."""


def to_fmi_unit(unit: str) -> str:
    """A unit in the spelling of FMI and Modelica: `N.m.s/rad` for `N*m*s/rad`."""
    return unit.replace("*", ".").replace("^", "")


def get_display_unit(unit: str) -> str | None:
    """Display unit of an SI unit, None where it is shown as it is."""
    return _DISPLAY[unit][0] if unit in _DISPLAY else None


def build_unit_definitions(units: Iterable[str]) -> ET.Element:
    """The element `UnitDefinitions` for SI units in ASCII."""
    root = ET.Element("UnitDefinitions")
    for unit in sorted(set(units)):
        item = ET.SubElement(root, "Unit", name=to_fmi_unit(unit))
        powers = parse_base_units(unit) or {}
        ET.SubElement(item, "BaseUnit", {base: str(power) for base, power in powers.items()})
        if unit in _DISPLAY:
            name, factor = _DISPLAY[unit]
            ET.SubElement(item, "DisplayUnit", name=name, factor=repr(factor))
    return root
