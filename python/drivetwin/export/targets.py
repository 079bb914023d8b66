# SPDX-License-Identifier: MIT
"""What a twin can be exported to."""

from __future__ import annotations

from enum import StrEnum


class Target(StrEnum):
    """A form of the twin for other programs."""

    C = "c"
    FMU = "fmu"
    SSV = "ssv"
    CDFX = "cdfx"
    DCM = "dcm"
    M = "m"
    JSON = "json"
    CSV = "csv"
