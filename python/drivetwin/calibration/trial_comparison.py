# SPDX-License-Identifier: MIT
"""Comparison of two controllers on the same draws, by paired statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t, wilcoxon

from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.trial import Trial

CONFIDENCE = 0.95
"""Confidence of intervals, and of all decisions together."""


@dataclass(frozen=True)
class Difference:
    """Paired difference of a metric in a scenario, second minus first controller, SI.

    `first` and `second` are means over `pairs` draws, `low` and `high` the interval of the mean
    difference by Student's t. `p` is that of Wilcoxon's signed-rank test, after Holm's correction
    for all rows of the comparison.
    """

    scenario: str
    metric: Metric
    pairs: int
    first: float
    second: float
    low: float
    high: float
    p: float

    @property
    def differs(self) -> bool:
        """True where the test rejects equal metrics."""
        return self.p < 1.0 - CONFIDENCE


def compare_trials(first: Sequence[Trial], second: Sequence[Trial]) -> list[Difference]:
    """Compare the metrics of two controllers in each scenario that both ran.

    Sources: F. Wilcoxon, Individual comparisons by ranking methods, Biometrics Bulletin 1 (1945);
    S. Holm, A simple sequentially rejective multiple test procedure, Scand. J. Statistics 6 (1979).
    """
    rows = [row for one, two in zip(first, second, strict=True) for row in _compare(one, two)]
    ordered, highest = sorted(range(len(rows)), key=lambda k: rows[k].p), 0.0
    for rank, k in enumerate(ordered):
        highest = max(highest, min(1.0, (len(rows) - rank) * rows[k].p))
        rows[k] = replace(rows[k], p=highest)
    return rows


def _compare(first: Trial, second: Trial) -> list[Difference]:
    if first.outcome is None or second.outcome is None:
        return []
    found = []
    for metric, before in first.outcome.values.items():
        after, pairs = second.outcome.values[metric], before.size
        change = after - before
        middle, spread = float(change.mean()), float(change.std(ddof=1)) if pairs > 1 else np.inf
        half = float(t.ppf(0.5 + 0.5 * CONFIDENCE, max(pairs - 1, 1))) * spread / np.sqrt(pairs)
        p = float(wilcoxon(change).pvalue) if np.any(change) else 1.0
        means = float(before.mean()), float(after.mean())
        found.append(
            Difference(first.scenario.name, metric, pairs, *means, middle - half, middle + half, p)
        )
    return found
