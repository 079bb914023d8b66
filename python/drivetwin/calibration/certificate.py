# SPDX-License-Identifier: MIT
"""Certificate of a calibration on draws that were not optimised over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, binom, norm

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Statistic
from drivetwin.calibration.promise import Promise

_BINDING = 0.02
"""Relative distance from a limit below which it binds."""


@dataclass(frozen=True)
class Quantiles:
    """Statistics of one metric over the draws, SI.

    `mean_upper`, `upper_95` and `upper_99` hold with the confidence of the certificate; None where
    there are too few draws. `worst` is the largest value. `promised` is the quantile, over vehicle
    types that the twin may stand for, of the 95 % value over units; None where no types were drawn.
    """

    median: float
    mean: float
    mean_upper: float
    share_95: float
    upper_95: float | None
    share_99: float
    upper_99: float | None
    worst: float
    promised: float | None = None


class LimitState(StrEnum):
    """State of a limit: also its upper bound is within it, its estimate alone, or neither."""

    CERTIFIED = "certified"
    KEPT = "kept, not certified"
    EXCEEDED = "exceeded"


@dataclass(frozen=True)
class LimitCheck:
    """A limit on the draws: estimate, and its upper bound with the certificate's confidence."""

    limit: Limit
    value: float
    upper: float | None

    @property
    def excess(self) -> float:
        """Relative excess of the upper bound, or of the estimate without one; negative within."""
        value = self.value if self.upper is None else self.upper
        return value / self.limit.bound - 1.0

    @property
    def state(self) -> LimitState:
        """State of the limit on the draws."""
        if self.upper is not None and self.upper <= self.limit.bound:
            return LimitState.CERTIFIED
        return LimitState.KEPT if self.value <= self.limit.bound else LimitState.EXCEEDED

    @property
    def text(self) -> str:
        """State in words, and whether the limit binds."""
        return f"{self.state.value}{', binds' if self.binding else ''}"

    @property
    def binding(self) -> bool:
        """True if the estimate lies within 2 % of the limit, or beyond it."""
        return self.value >= (1.0 - _BINDING) * self.limit.bound


@dataclass(frozen=True)
class Certificate:
    """Statistics by metric over `draws` fresh draws, with a confidence from 0 to 1.

    `worst_share` of all units stays below the worst value drawn, with that confidence. The upper
    bounds of the shares of units that do not lock, or lock twice, are of Clopper and Pearson.
    `shares` are those of the variance of peak jerk that go with each uncertainty.
    """

    draws: int
    confidence: float
    quantiles: Mapping[Metric, Quantiles]
    limits: tuple[LimitCheck, ...]
    worst_share: float
    unlocked: int
    unlocked_upper: float
    relocked: int
    relocked_upper: float
    shares: Mapping[str, float] = field(default_factory=dict)


def certify(
    outcome: Outcome,
    limits: Sequence[Limit],
    confidence: float,
    promise: Promise | None = None,
) -> Certificate:
    """Compute the certificate of an outcome over fresh draws, with the `promise` of its types."""
    draws = outcome.unlocked.size
    promised = {} if promise is None else promise.levels
    quantiles = {
        name: replace(compute_quantiles(values, confidence), promised=promised.get(name))
        for name, values in outcome.values.items()
    }
    return Certificate(
        draws=draws,
        confidence=confidence,
        quantiles=quantiles,
        limits=tuple(_check_limit(one, quantiles[one.metric]) for one in limits),
        worst_share=float((1.0 - confidence) ** (1.0 / draws)),
        unlocked=int(outcome.unlocked.sum()),
        unlocked_upper=compute_share_bound(outcome.unlocked, confidence),
        relocked=int(outcome.relocked.sum()),
        relocked_upper=compute_share_bound(outcome.relocked, confidence),
        shares={} if promise is None else promise.shares,
    )


def compute_quantiles(values: FloatArray, confidence: float) -> Quantiles:
    """Compute the statistics of values (n,)."""
    error = float(values.std(ddof=1)) / np.sqrt(values.size) if values.size > 1 else 0.0
    mean = float(values.mean())
    return Quantiles(
        median=float(np.median(values)),
        mean=mean,
        mean_upper=float(mean + norm.ppf(confidence) * error),
        share_95=float(np.quantile(values, 0.95)),
        upper_95=compute_quantile_bound(values, 0.95, confidence),
        share_99=float(np.quantile(values, 0.99)),
        upper_99=compute_quantile_bound(values, 0.99, confidence),
        worst=float(values.max()),
    )


def compute_quantile_bound(values: FloatArray, share: float, confidence: float) -> float | None:
    """Upper bound of the quantile `share` by an order statistic of values (n,).

    The k-th smallest of n exceeds the quantile where at most k - 1 draws lie below it, whose number
    is binomial; k is the least with that probability at least `confidence`. None where n is too
    small for any. Source: H. A. David and H. N. Nagaraja, Order Statistics, section 7.1.
    """
    rank = int(binom.ppf(confidence, values.size, share)) + 1
    return float(np.sort(values)[rank - 1]) if rank <= values.size else None


def compute_share_bound(marks: NDArray[np.bool_], confidence: float) -> float:
    """Upper bound of the share of marked units, of Clopper and Pearson."""
    count, draws = int(marks.sum()), marks.size
    return 1.0 if count == draws else float(beta.ppf(confidence, count + 1, draws - count))


def _check_limit(limit: Limit, found: Quantiles) -> LimitCheck:
    if limit.statistic is Statistic.MEAN:
        return LimitCheck(limit, found.mean, found.mean_upper)
    return LimitCheck(limit, found.share_95, found.upper_95)
