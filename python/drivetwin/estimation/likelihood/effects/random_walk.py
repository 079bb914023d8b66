# SPDX-License-Identifier: MIT
"""Random walks less their means: Karhunen-Loève columns, and samples for synthetic logs."""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.dual_clutch import Signal

_STEP = 0.01
"""Time between the points of a sample [s], short against what a shift log resolves of it."""


def build_random_walk(progress: FloatArray, count: int, growth: float) -> list[FloatArray]:
    """Build the first `count` columns (N,) of a random walk less its mean over a span.

    Parameters
    ----------
    progress : share (N,) of the span that has passed, 0 to 1
    growth : standard deviation of the walk's change over the whole span

    Notes
    -----
    A Wiener process of variance `growth`² at the end of the span, less its mean, is the sum of
    cosines cos(kπu) with independent amounts of standard deviation growth·√2/(kπ).
    """
    order = np.arange(1, count + 1)
    sizes = growth * np.sqrt(2.0) / (order * np.pi)
    return [size * np.cos(k * np.pi * progress) for k, size in zip(order, sizes, strict=True)]


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
