# SPDX-License-Identifier: MIT
"""Promise of a calibration: level that a share of the units of the true vehicle type keeps.

A log leaves a range of vehicle types. Each type has units of its own, of which 95 % stay below a
value. The promise is a high quantile of this value over the types: it holds for 95 % of the units
of the true type, with that confidence. Values pooled over types and units do not: a type at the
edge of the range may have all of its units above them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.metrics import Metric, Outcome
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
