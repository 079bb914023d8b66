# SPDX-License-Identifier: MIT
"""The twin for other programs: C, FMU, parameter files, Modelica."""

from __future__ import annotations
