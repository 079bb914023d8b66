# SPDX-License-Identifier: MIT
"""Friction curves of all logs of a fleet as one curve with the band that holds 95 % of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.store import Store

_POINTS = 40
_LEAST = 5
"""Logs that must reach a slip."""


def compute_fleet_friction(store: Store) -> dict[str, FrictionCurve]:
    """Median μ over slip of each element, and the band from 2.5 to 97.5 % of all logs' curves."""
    import pyarrow.compute as pc

    rows = store.read_rows(RowKind.FRICTION).select(["log", "name", "value", "at"])
    found = {}
    for element in sorted(set(rows.column("name").to_pylist())):
        picked = rows.filter(pc.equal(rows.column("name"), element))
        logs, slip, mu = (np.asarray(picked.column(name)) for name in ("log", "at", "value"))
        ends = np.flatnonzero(logs[1:] != logs[:-1]) + 1
        curves = list(zip(np.split(slip, ends), np.split(mu, ends), strict=True))
        curve = _compute_percentiles(curves)
        if curve is not None:
            found[element] = curve
    return found


def _compute_percentiles(curves: Sequence[tuple[FloatArray, FloatArray]]) -> FrictionCurve | None:
    """Percentiles over the curves (slip, μ) at slips that enough of them reach."""
    grid = np.linspace(
        min(slip[0] for slip, _ in curves), max(slip[-1] for slip, _ in curves), _POINTS
    )
    table = np.array([np.interp(grid, slip, mu, left=np.nan, right=np.nan) for slip, mu in curves])
    reached = np.count_nonzero(np.isfinite(table), axis=0) >= _LEAST
    if np.count_nonzero(reached) < 2:
        return None
    low, median, high = np.nanpercentile(table[:, reached], [2.5, 50.0, 97.5], axis=0)
    empty = np.empty(0)
    return FrictionCurve(grid[reached], median, low, high, empty, empty, None, "median of all logs")
