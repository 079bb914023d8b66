# SPDX-License-Identifier: MIT
"""Drift of the output torque sensor within a shift."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.effects.random_walk import build_random_walk
from drivetwin.vehicle.effects import EffectId

COUNT = 4
"""Columns of the walk: drift slower than an eighth of the span is what moves parameters."""
REFERENCE_S = 5.0
"""Time [s] over which the prior states the drift."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a random walk to the output torque of the shift."""
    growth = std * at.largest_shaft_torque * float(np.sqrt(at.duration / REFERENCE_S))
    columns = build_random_walk(at.progress, COUNT, growth)
    label = at.describe_shift()
    return [Disturbance(label, outputs={OUTPUT_TORQUE: column}) for column in columns]


EFFECT = Effect(
    EffectId.OUTPUT_TORQUE_DRIFT,
    "a drift of the output torque",
    "of the largest shaft torque over 5 s",
    0.003,
    "typical range of strain gauges on a shaft by warm-up and bending crosstalk, 0.1 to 0.5 % of "
    "full scale",
    "let the torque sensor warm up and compare its zero before and after the recording",
    build,
    random=True,
)
