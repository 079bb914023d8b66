# SPDX-License-Identifier: MIT
"""Load that changes slowly within a shift, as by grade and wind."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint, compute_middle
from drivetwin.estimation.likelihood.effects.random_walk import build_random_walk
from drivetwin.vehicle.effects import EffectId

COUNT = 6
"""Columns of the walk; faster changes of a load are averaged out by the vehicle's inertia."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Let the load at the wheel follow a random walk over the shift."""
    growth = std * at.load * at.model.i_f * float(np.sqrt(at.duration))
    columns = build_random_walk(at.progress, COUNT, growth)
    label = at.describe_shift()
    return [Disturbance(label, at.build_force(2, -compute_middle(one))) for one in columns]


EFFECT = Effect(
    EffectId.SLOW_LOAD,
    "a load that changes slowly, as by grade or wind",
    "of the load per square root of a second",
    0.004,
    "engineering estimate for level roads: the grade changes by 0.01 to 0.05 % over 100 m, of the "
    "order of a hundredth of the load",
    "record on a level track or a dynamometer, and several shifts in both directions",
    build,
    random=True,
)
