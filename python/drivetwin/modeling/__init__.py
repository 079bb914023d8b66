# SPDX-License-Identifier: MIT
"""Builder of driveline models: typed elements with ports, runs, schematics, Modelica."""

from __future__ import annotations
