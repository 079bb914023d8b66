# SPDX-License-Identifier: MIT
"""Friction curves of all logs of a fleet as one curve with the band that holds 95 % of them."""

from __future__ import annotations

import numpy as np

from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.store import Store
from drivetwin.identify.result import FrictionCurve

_BINS = 40
_LEAST = 5
"""Points that a slip must have."""


def fleet_friction(store: Store) -> dict[str, FrictionCurve]:
    """Median μ over slip of each element, and the band from 2.5 to 97.5 % of all logs' curves."""
    import pyarrow.compute as pc

    rows = store.rows(RowKind.FRICTION).select(["name", "value", "at"])
    found = {}
    for element in sorted(set(rows.column("name").to_pylist())):
        picked = rows.filter(pc.equal(rows.column("name"), element))
        curve = _curve(*(np.asarray(picked.column(name)) for name in ("at", "value")))
        if curve is not None:
            found[element] = curve
    return found


def _curve(
    slip: np.ndarray[tuple[int], np.dtype[np.float64]],
    mu: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> FrictionCurve | None:
    edges = np.linspace(slip.min(), slip.max(), _BINS + 1)
    place = np.clip(np.digitize(slip, edges) - 1, 0, _BINS - 1)
    bins = [k for k in range(_BINS) if np.count_nonzero(place == k) >= _LEAST]
    if len(bins) < 2:
        return None
    middle = np.array([0.5 * (edges[k] + edges[k + 1]) for k in bins])
    low, median, high = np.array([np.percentile(mu[place == k], [2.5, 50.0, 97.5]) for k in bins]).T
    empty = np.empty(0)
    return FrictionCurve(middle, median, low, high, empty, empty, None, "median of all logs")
