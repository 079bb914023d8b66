# SPDX-License-Identifier: MIT
"""Karhunen-Loève columns of a random walk less its mean."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray


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
