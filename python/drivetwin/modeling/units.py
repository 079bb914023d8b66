# SPDX-License-Identifier: MIT
"""SI values of common units: `800 * RPM` is a speed in rad/s, `2.5 * BAR` a pressure in Pa."""

from __future__ import annotations

from drivetwin.channels.units import BAR, DEG, RPM

__all__ = ["BAR", "DEG", "KILOMETRE_PER_HOUR", "KILOWATT", "MILLISECOND", "RPM"]

KILOMETRE_PER_HOUR = 1.0 / 3.6
KILOWATT = 1e3
MILLISECOND = 1e-3
