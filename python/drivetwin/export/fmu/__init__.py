# SPDX-License-Identifier: MIT
"""FMU export: the C model behind FMI 2.0 or 3.0, with sources, binaries and a worked experiment."""

from __future__ import annotations

from drivetwin.export.fmu.build import BuildOptions, build_fmu
from drivetwin.export.fmu.variables import FmiVersion

__all__ = ["BuildOptions", "FmiVersion", "build_fmu"]
