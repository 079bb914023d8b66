# SPDX-License-Identifier: MIT
"""Certificate of a calibration on draws that were not optimised over, and its promise.

The promise is a level that a share of the units of the true vehicle type keeps. A log leaves a
range of vehicle types. Each type has units of its own, of which 95 % stay below a value. The
promise is a high quantile of this value over the types: it holds for 95 % of the units of the true
type, with that confidence. Values pooled over types and units do not: a type at the edge of the
range may have all of its units above them.
"""

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
from drivetwin.calibration.scenarios import Scenarios

UNIT_SHARE = 0.95
"""Share of the units of a type that keep their value."""
TYPES, UNITS = "uncertainty of identified values", "production scatter"
"""Names of the two stages of the draws."""
ACTUATORS = "actuators"
"""Name of the actuators and the engine lag among the uncertainties."""
COMMON = "several together"
"""Name of the variance that goes with more than one element."""


@dataclass(frozen=True)
class Promise:
    """Promised levels (SI) by metric, and shares of the variance of peak jerk by uncertainty.

    The shares of the two stages add up to 1. So do the others with what no quadratic explains: each
    is the part that only this element explains, `COMMON` that of elements whose values go together.
    The latter is below zero where they cancel each other.
    """

    levels: Mapping[Metric, float]
    shares: Mapping[str, float]


def compute_promise(
    outcome: Outcome, scenarios: Scenarios, types: int, confidence: float
) -> Promise:
    """Compute the promise from the outcome over units (types · n,), those of a type in sequence.

    Parameters
    ----------
    outcome
        Metrics of each unit.
    scenarios
        The units, as `draw_types` returns them.
    types
        Number of vehicle types.
    confidence
        Share of the types for which the promise holds.

    Returns
    -------
    Promise
        Levels of all metrics, shares of the variance of peak jerk.
    """
    levels = {}
    for name, values in outcome.values.items():
        of_types = np.quantile(values.reshape(types, -1), UNIT_SHARE, axis=1)
        levels[name] = float(np.quantile(of_types, confidence))
    jerk = outcome.values[Metric.PEAK_JERK]
    return Promise(levels, _compute_shares(jerk, scenarios, types))


def _compute_shares(values: FloatArray, scenarios: Scenarios, types: int) -> dict[str, float]:
    """Compute the shares of the variance of values (runs,)."""
    whole = float(values.var())
    if whole == 0.0:
        return {}
    by_type = values.reshape(types, -1)
    between = float(by_type.mean(axis=1).var())
    shares = {TYPES: between / whole, UNITS: 1.0 - between / whole}
    terms = {name: _expand(one) for name, one in _group_numbers(scenarios).items()}
    together = _explain(values, list(terms.values()))
    own = {
        name: together - _explain(values, [one for each, one in terms.items() if each != name])
        for name in terms
    }
    return shares | own | {COMMON: together - sum(own.values())}


def _group_numbers(scenarios: Scenarios) -> dict[str, FloatArray]:
    """Return the drawn numbers (runs, n) of each element and of the actuators by name."""
    groups: dict[str, list[FloatArray]] = {}
    for path, values in scenarios.sets.items():
        element = path.split(".", 1)[0]
        if element != "start":  # the start follows from the other numbers
            groups.setdefault(element, []).append(values)
    found = {name: np.stack(columns, axis=1) for name, columns in groups.items()}
    if scenarios.units:
        found[ACTUATORS] = np.array(
            [
                [one.engine_lag, *one.offgoing.values, *one.oncoming.values]
                for one in scenarios.units
            ]
        )
    return found


def _expand(columns: FloatArray) -> FloatArray:
    """Return the terms (n, t) of a quadratic in columns (n, k), without its constant."""
    varied = columns[:, np.ptp(columns, axis=0) > 0.0]
    unit = (varied - varied.mean(axis=0)) / varied.std(axis=0)
    first, second = np.triu_indices(unit.shape[1])
    return np.concatenate([unit, unit[:, first] * unit[:, second]], axis=1)


def _explain(values: FloatArray, terms: Sequence[FloatArray]) -> float:
    """Share of the variance of values (n,) by terms (n, t) of all elements, without chance.

    Nothing where there are fewer values than coefficients.

    Source: H. Theil, Principles of Econometrics (1971), adjusted coefficient of determination.
    """
    rows = np.concatenate([np.ones((values.size, 1)), *terms], axis=1)
    found, _, rank, _ = np.linalg.lstsq(rows, values, rcond=None)
    rest = float(np.sum((values - rows @ found) ** 2)) / max(values.size - int(rank), 1)
    return float(1.0 - rest / values.var(ddof=1)) if values.size > rank else 0.0


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
