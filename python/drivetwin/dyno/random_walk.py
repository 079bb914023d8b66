# SPDX-License-Identifier: MIT
"""Random walks of loads and sensors."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from drivetwin.simulation.dual_clutch import Signal

_STEP = 0.01
"""Time between the points of a walk [s], short against what a shift log resolves of it."""


class WalkStream(IntEnum):
    """Streams of random numbers, apart from the noise of the sensors and from each other."""

    LOAD = 101
    OUTPUT_TORQUE = 102


def draw_walk(stream: WalkStream, seed: int, duration: float) -> Signal:
    """Draw a random walk over `duration` [s], its variance 1 after 1 s, less its mean."""
    count = int(np.ceil(duration / _STEP)) + 1
    steps = np.random.default_rng([seed, stream]).standard_normal(count - 1) * np.sqrt(_STEP)
    walk = np.concatenate([[0.0], np.cumsum(steps)])
    return Signal(
        np.linspace(0.0, (count - 1) * _STEP, count),
        np.asarray(walk - np.mean(walk), dtype=np.float64),
    )
