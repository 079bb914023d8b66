# SPDX-License-Identifier: MIT
"""Objective of a calibration: tail mean of peak jerk, with exact penalties for limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import spell_unit
from drivetwin.calibration.metrics import METRICS, Metric, Outcome
from drivetwin.errors import InputError


class Statistic(StrEnum):
    """Statistic over the draws that a limit bounds."""

    MEAN = "mean"
    SHARE_95 = "95 %"


@dataclass(frozen=True)
class Limit:
    """Upper bound (SI) of a metric, for its mean or for 95 % of the draws, and its `source`."""

    metric: Metric
    bound: float
    statistic: Statistic = Statistic.SHARE_95
    source: str = ""

    def __post_init__(self) -> None:
        if not 0.0 < self.bound < float("inf"):
            raise InputError(
                f"the limit of {self.metric} is {self.bound!r}",
                f"give a finite positive number in {spell_unit(METRICS[self.metric].unit)}",
            )

    def measure(self, outcome: Outcome) -> FloatArray:
        """Relative distance from the bound, below 0 within it: (1,) of a mean, else (runs,)."""
        values = outcome.values[self.metric] / self.bound - 1.0
        mean = self.statistic is Statistic.MEAN
        return np.asarray(values.mean(keepdims=True) if mean else values)


_SUFFIX = {
    "m/s^3": "m_s3",
    "m/s^1.75": "m_s175",
    "N*m": "Nm",
    "s": "s",
    "J": "J",
    "W": "W",
    "rad/s": "rad_s",
    "Pa/s": "Pa_s",
    "N*m/s": "Nm_s",
}
"""Units as keys of a file have them."""


def build_limit_keys() -> dict[str, tuple[Metric, Statistic]]:
    """Return the keys of `[limits]`: for 95 % of the draws, and with `mean_` for their mean."""
    keys = {}
    for metric, spec in METRICS.items():
        name = f"{metric.value}_{_SUFFIX[spec.unit]}"
        keys[name] = metric, Statistic.SHARE_95
        keys[f"mean_{name}"] = metric, Statistic.MEAN
    return keys


def compute_tail_mean(values: FloatArray, share: float) -> float:
    """Mean of the largest part of `values` (n,) beyond the quantile `share` (CVaR).

    Source: R. T. Rockafellar and S. Uryasev, Optimization of conditional value-at-risk, Journal
    of Risk 2 (2000).
    """
    count = max(1, round((1.0 - share) * values.size))
    return float(np.sort(values)[-count:].mean())


@dataclass(frozen=True)
class Objective:
    """Tail mean of peak jerk beyond the quantile `share`, plus penalties.

    These are `weight` times the relative excesses over the limits, and times `held` of the share
    of units whose on-coming element slips again after its lock-up.
    """

    limits: Sequence[Limit]
    share: float
    weight: float
    held: float = 1.0

    def evaluate(self, outcome: Outcome) -> float:
        """Return the value [m/s^3] of an outcome; smaller is better."""
        comfort = compute_tail_mean(outcome.values[Metric.PEAK_JERK], self.share)
        excess = sum(float(np.maximum(one.measure(outcome), 0.0).mean()) for one in self.limits)
        return comfort + self.weight * (excess + self.held * float(outcome.relocked.mean()))

    def tighten(self, margins: Sequence[float]) -> Objective:
        """Return the objective with bounds lower by relative `margins`, one for each limit."""
        limits = tuple(
            replace(one, bound=(1.0 - margin) * one.bound)
            for one, margin in zip(self.limits, margins, strict=True)
        )
        return replace(self, limits=limits)

    def scale_weight(self, factor: float) -> Objective:
        """Return the objective with another weight of the excesses."""
        return replace(self, weight=factor * self.weight)
