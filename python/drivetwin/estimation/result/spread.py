# SPDX-License-Identifier: MIT
"""Predicted spread of a simulated signal."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin._util.arrays import FloatArray

EXPLAINED = 1.1
"""Residual power over that of noise up to which a model explains a log. A tenth is the uncertainty
of noise levels; beyond it something is missing from the model."""


@dataclass(frozen=True, eq=False)
class PredictedSpread:
    """Distribution at `time` (n,) [s] of a measured less a simulated signal if the model is right.

    `mean` (n,) is the action of the effects that the log shows and the simulation lacks, and of
    samples that are means over their period; `std` (n,) the standard deviation. Both are SI, speeds
    of the engine side those of the engine.
    """

    time: FloatArray
    mean: FloatArray
    std: FloatArray
