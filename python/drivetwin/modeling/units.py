# SPDX-License-Identifier: MIT
"""SI values of common units: `800 * RPM` is a speed in rad/s, `2.5 * BAR` a pressure in Pa."""

from __future__ import annotations

from math import pi

RPM = pi / 30.0
DEG = pi / 180.0
BAR = 1e5
KILOMETRE_PER_HOUR = 1.0 / 3.6
KILOWATT = 1e3
MILLISECOND = 1e-3
