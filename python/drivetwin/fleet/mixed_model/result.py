# SPDX-License-Identifier: MIT
"""Joint estimate of one parameter; SI, fields in the unit of their name."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from drivetwin.fleet.mixed_model.mixed import FloatArray

Interval = tuple[float, float]


@dataclass(frozen=True)
class Drift:
    """Change of the parameter with one unit of a field, 95 % interval; `reference` is the field's
    mean, at which the shared value holds. `spread` (1 σ) is how much units differ in it.
    """

    field: str
    slope: float
    ci95: Interval
    reference: float
    spread: float | None = None


@dataclass(frozen=True)
class UnitValue:
    """Deviation of a unit from the shared value, and its standard error.

    `score` is the deviation in robust standard deviations of all units; `odd` is true if it is
    significant.
    """

    unit: str
    logs: int
    deviation: float
    std: float
    score: float | None
    odd: bool


@dataclass(frozen=True)
class Outlier:
    """A log that does not fit: `score` standard deviations from what its unit and fields let
    expect, and what else is odd about it.
    """

    log: str
    path: str
    unit: str
    value: float
    expected: float
    score: float
    reason: str


@dataclass(frozen=True, eq=False)
class Points:
    """The logs behind an estimate, for figures: readings of the first field (NaN without one),
    values and standard deviations (n,), units (n,).
    """

    reading: FloatArray
    value: FloatArray
    std: FloatArray
    unit: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class JointEstimate:
    """Joint estimate of one parameter over the units of one rule.

    `value` is shared by all units, at the fields' references; `spread` (1 σ) is the scatter between
    units. `excess` is the ratio of the scatter of the logs to their stated uncertainty. `left_out`
    counts the logs without a value.
    """

    parameter: str
    rule: str
    si_unit: str
    logs: int
    left_out: int
    value: float
    ci95: Interval
    spread: float | None
    spread_ci95: Interval | None
    excess: float
    drifts: tuple[Drift, ...]
    units: tuple[UnitValue, ...]
    outliers: tuple[Outlier, ...]
    notes: tuple[str, ...]
    points: Points

    def to_document(self) -> dict[str, Any]:
        """For JSON, without the single points."""
        return {key: value for key, value in asdict(self).items() if key != "points"}
