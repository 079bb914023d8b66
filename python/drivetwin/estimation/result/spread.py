# SPDX-License-Identifier: MIT
"""Predicted spread of a simulated signal, and the status of a model that it is held against."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drivetwin._util.arrays import FloatArray


class ModelStatus(StrEnum):
    """Status of an identified model by its free-running simulation."""

    VALID = "valid"
    LIMITED = "valid with limits"
    NOT_VALID = "not valid"
    NOT_VALIDATED = "not validated"


@dataclass(frozen=True, eq=False)
class PredictedSpread:
    """Standard deviation `std` (n,) at `time` (n,) [s] of a simulated less a measured signal that
    a right model has, SI; engine-side speeds are those of the engine."""

    time: FloatArray
    std: FloatArray
