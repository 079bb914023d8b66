# SPDX-License-Identifier: MIT
"""Export targets of a twin."""

from __future__ import annotations

from enum import StrEnum


class Target(StrEnum):
    """A form of the twin for other programs."""

    C = "c"
    FMU = "fmu"
    MODELICA = "modelica"
    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    JSON = "json"
    CSV = "csv"

    @property
    def ending(self) -> str:
        """Ending of its files."""
        return "mo" if self is Target.MODELICA else self.value
