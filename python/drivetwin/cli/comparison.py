# SPDX-License-Identifier: MIT
"""Comparison of the true values of a synthetic log with the estimates of the methods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetwin.dyno.truth import Truth
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.parameters import get_parameter_spec

_SLIPS = (10.0, 30.0, 50.0, 80.0)
"""Slips [rad/s] at which friction coefficients are compared."""


@dataclass(frozen=True)
class Found:
    """Value and total 95 % interval of one method; None if not estimated."""

    value: float | None = None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class Row:
    """One quantity: id, true value, what each method found, SI unit."""

    id: str
    truth: float
    found: Mapping[Method, Found]
    unit: str

    def to_document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "id": self.id,
            "truth": self.truth,
            "unit": self.unit,
            **{
                method.value: {"value": one.value, "ci95_total": one.interval}
                for method, one in self.found.items()
            },
        }


def compare(truth: Truth, found: Mapping[Method, Identification]) -> list[Row]:
    """Rows for all true parameters that some method answers, then friction over slip."""
    rows = [
        Row(
            key,
            value,
            {m: _get_estimate(one, key) for m, one in found.items()},
            get_parameter_spec(key).unit,
        )
        for key, value in truth.parameters.items()
        if any(key in one.estimates for one in found.values())
    ]
    for element, law in truth.friction.items():
        for slip in _SLIPS:
            points = {method: _get_friction(one, element, slip) for method, one in found.items()}
            if any(point.value is not None for point in points.values()):
                rows.append(
                    Row(f"mu.{element} @{slip:g}", float(law.evaluate(np.array(slip))), points, "1")
                )
    return rows


def _get_estimate(found: Identification, key: str) -> Found:
    estimate = found.estimates.get(key)
    return Found() if estimate is None else Found(estimate.value, estimate.ci95_total)


def _get_friction(found: Identification, element: str, slip: float) -> Found:
    """The curve of an element at one slip; nothing outside the slip range seen."""
    curve = found.friction.get(element)
    if curve is None or not curve.slip[0] <= slip <= curve.slip[-1]:
        return Found()
    mu, low, high = (
        float(np.interp(slip, curve.slip, values))
        for values in (curve.mu, curve.mu_lo, curve.mu_hi)
    )
    return Found(mu, (low, high) if np.isfinite(high - low) else None)
