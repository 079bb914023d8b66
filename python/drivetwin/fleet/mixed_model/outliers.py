# SPDX-License-Identifier: MIT
"""Logs and units that do not belong to the rest, decided against the number of them all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from drivetwin.fleet.mixed_model.mixed import FloatArray, IntArray

FALSE_ALARMS = 0.05
"""Probability of one outlier found in a fleet that has none."""
_LEAST_LIMIT = 4.0
_LEAST_UNITS = 5
_FEW_UNITS = (5, 6, 7, 8, 9, 10, 12, 14, 16, 20)
_FEW_LIMITS = (8.0, 5.6, 5.9, 5.0, 5.1, 4.6, 4.4, 4.3, 4.2, _LEAST_LIMIT)
"""Scores that the farthest of so few units goes beyond in FALSE_ALARMS of 400,000 simulated fleets
of normally distributed units: the middle and the scatter of few units are themselves uncertain, and
those of an odd number more.
"""
_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
_ROUGH = 8.0
"""Robust standard deviations beyond which a log does not take part in the first fit."""


def compute_outlier_limit(count: int) -> float:
    """Standard deviations beyond which one of `count` is an outlier."""
    return max(_LEAST_LIMIT, float(norm.isf(0.5 * FALSE_ALARMS / max(count, 1))))


def compute_unit_limit(count: int) -> float:
    """Score beyond which one of `count` units is more than chance makes."""
    return max(compute_outlier_limit(count), float(np.interp(count, _FEW_UNITS, _FEW_LIMITS)))


def select_plausible(values: FloatArray, unit: IntArray) -> NDArray[np.bool_]:
    """Return the mask of the values (n,) near their unit's median, usable in a first fit."""
    middles = np.array([np.median(values[unit == k]) for k in range(int(unit.max()) + 1)])
    away = np.abs(values - middles[unit])
    scale = _TO_SIGMA * float(np.median(away))
    return np.asarray(away <= _ROUGH * scale) if scale > 0.0 else np.ones(values.size, np.bool_)


def compute_unit_scores(deviation: FloatArray) -> FloatArray:
    """Return the robust z-score (units,) of each unit's deviation.

    NaN if there are too few units.
    """
    away = deviation - np.median(deviation)
    scale = _TO_SIGMA * float(np.median(np.abs(away)))
    if deviation.size < _LEAST_UNITS or scale == 0.0:
        return np.full(deviation.size, np.nan)
    return away / scale
