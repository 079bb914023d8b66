# SPDX-License-Identifier: MIT
"""Inputs of a model: a number, points of a ramp, samples or a sine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Sine
from drivetwin.simulation.serialize import format_value

InputValue = float | Sequence[tuple[float, float]] | FloatArray | Signal | Sine
"""A constant; points (n, 2) of time [s] and value, linear between and constant beyond; samples."""


def make_input(name: str, value: InputValue, span: tuple[float, float]) -> Signal | Sine:
    """Return the input of a run over `span` [s]. Raises InputError for what is none."""
    if isinstance(value, Signal | Sine):
        return value
    try:
        points = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.zeros((0, 0))
    if points.ndim == 0:
        points = np.array([[span[0], float(points)]])
    if points.ndim != 2 or points.shape[1] != 2 or not len(points):
        raise InputError(
            f"the input of {name} is {format_value(value)}",
            "give a number, points [(time, value), ...], a Signal or a Sine",
        )
    first, last = points[0], points[-1]
    rows = [
        *([(span[0], first[1])] if first[0] > span[0] else []),
        *map(tuple, points),
        *([(span[1], last[1])] if last[0] < span[1] else []),
    ]
    time, values = np.array(rows).T
    return Signal(time, values)
