# SPDX-License-Identifier: MIT
"""Promise of a calibration: level that a share of the units of the true vehicle type keeps.

A log leaves a range of vehicle types. Each type has units of its own, of which 95 % stay below a
value. The promise is a high quantile of this value over the types: it holds for 95 % of the units
of the true type, with that confidence. Values pooled over types and units do not: a type at the
edge of the range may have all of its units above them.
"""

from __future__ import annotations

from collections.abc import Mapping
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


@dataclass(frozen=True)
class Promise:
    """Promised levels (SI) by metric, and shares of the variance of peak jerk by uncertainty.

    The shares of the two stages add up to 1. Each other share is that of the best fit by one
    element alone; elements whose values go together share theirs.
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
    explained = {name: _explain(values, one) for name, one in _group_numbers(scenarios).items()}
    return shares | {name: one for name, one in explained.items() if one is not None}


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


def _explain(values: FloatArray, columns: FloatArray) -> float | None:
    """Share of the variance of values (n,) by a quadratic in columns (n, k), without chance.

    None where there are fewer values than coefficients.

    Source: H. Theil, Principles of Econometrics (1971), adjusted coefficient of determination.
    """
    varied = columns[:, np.ptp(columns, axis=0) > 0.0]
    if varied.shape[1] == 0:
        return 0.0
    unit = (varied - varied.mean(axis=0)) / varied.std(axis=0)
    first, second = np.triu_indices(unit.shape[1])
    rows = np.concatenate([np.ones((len(unit), 1)), unit, unit[:, first] * unit[:, second]], axis=1)
    found, _, rank, _ = np.linalg.lstsq(rows, values, rcond=None)
    free = len(values) - int(rank)
    if free <= 0:
        return None
    rest = float(np.sum((values - rows @ found) ** 2)) / free
    return float(np.clip(1.0 - rest / values.var(ddof=1), 0.0, 1.0))
