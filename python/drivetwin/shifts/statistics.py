# SPDX-License-Identifier: MIT
"""Statistics of one figure of shift quality over many shifts: outliers, trend, difference.

All are free of units, and all but the outliers of the distribution. `scipy.stats` is imported when
needed, since most commands do without.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray

LEVEL = 0.05
"""Probability of a false alarm of each test, corrected for the number of tests made together."""
_FEWEST_FOR_OUTLIERS = 15
"""Fewest values of the outlier test: Rosner states its level from there on."""
_FEWEST = 4
"""Fewest values in each group: with three against three no rank test reaches the level."""


@dataclass(frozen=True)
class Trend:
    """Slope of a figure over time, in its unit per s, with its 95 % interval and p-value."""

    slope: float
    interval: tuple[float, float]
    p: float


@dataclass(frozen=True)
class Difference:
    """Typical difference of a second group from a first, with its 95 % interval and p-value."""

    shift: float
    interval: tuple[float, float]
    p: float


def find_outliers(values: FloatArray) -> tuple[int, ...]:
    """Find outliers by the generalised extreme Studentized deviate.

    Parameters
    ----------
    values : figures (n,); where all are positive the test is made on their logarithms, since
        durations and jerks are skewed

    Returns
    -------
    tuple of int
        Indices of the outliers, the farthest first; none for fewer than 15 values. At most a tenth
        of the values.

    Source: Rosner, Technometrics 25 (1983) 165.
    """
    from scipy.stats import t

    count = len(values)
    if count < _FEWEST_FOR_OUTLIERS:
        return ()
    left = np.log(values) if np.all(values > 0.0) else np.asarray(values, dtype=np.float64)
    left = left.copy()
    removed: list[int] = []
    found = 0
    for done in range(max(1, count // 10)):
        rest = count - done
        deviation = np.abs(left - np.nanmean(left))
        spread = float(np.nanstd(left, ddof=1))
        if not spread > 0.0:
            break
        farthest = int(np.nanargmax(deviation))
        quantile = float(t.ppf(1.0 - LEVEL / (2.0 * rest), rest - 2))
        limit = (rest - 1) * quantile / math.sqrt((rest - 2 + quantile**2) * rest)
        removed.append(farthest)
        if deviation[farthest] > limit * spread:
            found = len(removed)
        left[farthest] = np.nan
    return tuple(removed[:found])


def estimate_trend(time: FloatArray, values: FloatArray) -> Trend | None:
    """Estimate the slope of a figure over time.

    Parameters
    ----------
    time : times (n,) [s]
    values : figures (n,)

    Returns
    -------
    Trend or None
        Median of the slopes of all pairs; the p-value is that of Kendall's rank correlation. None
        for fewer than 4 values, or equal values.

    Source: Sen, J. Am. Stat. Assoc. 63 (1968) 1379.
    """
    from scipy.stats import kendalltau, theilslopes

    if len(values) < _FEWEST or np.ptp(values) == 0.0 or np.ptp(time) == 0.0:
        return None
    slope, _, low, high = theilslopes(values, time, 1.0 - LEVEL)
    p = float(kendalltau(time, values).pvalue)
    return Trend(float(slope), (float(low), float(high)), p)


def compare_groups(first: FloatArray, second: FloatArray) -> Difference | None:
    """Compare a figure of two groups of shifts.

    Parameters
    ----------
    first, second : figures (m,), (n,)

    Returns
    -------
    Difference or None
        Median of all differences of a value in `second` from one in `first`; its interval and the
        p-value are those of the rank-sum test. None for fewer than 4 values in a group.

    Source: Hodges and Lehmann, Ann. Math. Stat. 34 (1963) 598; Hollander, Wolfe, Chicken,
    Nonparametric Statistical Methods (2014), section 4.3.
    """
    from scipy.stats import mannwhitneyu, norm

    m, n = len(first), len(second)
    if min(m, n) < _FEWEST:
        return None
    differences = np.sort((second[:, None] - first[None, :]).ravel())
    half = float(norm.ppf(1.0 - LEVEL / 2.0)) * math.sqrt(m * n * (m + n + 1) / 12.0)
    outside = max(0, math.floor(0.5 * m * n - half))
    p = float(mannwhitneyu(first, second).pvalue)
    interval = (float(differences[outside]), float(differences[-1 - outside]))
    return Difference(float(np.median(differences)), interval, p)


def adjust_p_values(values: Sequence[float]) -> tuple[float, ...]:
    """Adjust the p-values of tests made together so that none is a false alarm by their number.

    Parameters
    ----------
    values : p-values

    Returns
    -------
    tuple of float
        Adjusted p-values in the order of `values`.

    Source: Holm, Scand. J. Stat. 6 (1979) 65.
    """
    order = sorted(range(len(values)), key=lambda index: values[index])
    adjusted, largest = [0.0] * len(values), 0.0
    for rank, index in enumerate(order):
        largest = max(largest, min(1.0, (len(values) - rank) * values[index]))
        adjusted[index] = largest
    return tuple(adjusted)
