# SPDX-License-Identifier: MIT
"""Predicted spread of a simulated signal."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class PredictedSpread:
    """Distribution at `time` (n,) [s] of a measured less a simulated signal if the model is right.

    `mean` (n,) is the action of the effects that the log shows and the simulation lacks, `std`
    (n,) the standard deviation; SI, speeds of the engine side those of the engine.
    """

    time: FloatArray
    mean: FloatArray
    std: FloatArray
