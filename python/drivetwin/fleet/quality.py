# SPDX-License-Identifier: MIT
"""Shift quality of the units of a fleet: distribution over the fleet, units that differ from it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.fleet.index import ONE_FILE_EACH
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.store import Store
from drivetwin.shifts.summary import (
    SUMMARIZED,
    FigureComparison,
    FiguresByKind,
    adjust_comparisons,
    compare_figures,
)
from drivetwin.vehicle.shift_kind import ShiftKind

_SHIFTS = (
    "SELECT files.unit, shifts.log, shifts.shift, kind, start_gear, end_gear FROM shifts "
    f"JOIN files USING (log) WHERE shifts.state = 'used' AND kind <> '' AND {ONE_FILE_EACH}"
)
_MOST = 1000
"""Most values of the others in one comparison: more do not change the result visibly."""


def collect_unit_figures(store: Store) -> dict[str, FiguresByKind]:
    """Collect the figures of shift quality of each unit.

    Parameters
    ----------
    store : store of a fleet

    Returns
    -------
    dict
        Figures by unit; a log stored in several places counts once.
    """
    shifts = {
        (log, number): (unit, ShiftKind(kind), f"{start}→{end}")
        for unit, log, number, kind, start, end in store.index.select(_SHIFTS)
    }
    rows = store.read_rows(RowKind.QUALITY).select(["log", "shift", "name", "value"])
    found: dict[str, dict[tuple[ShiftKind, str, str], list[float]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for log, number, name, value in zip(*(one.to_pylist() for one in rows.columns), strict=True):
        if name in SUMMARIZED and (log, number) in shifts:
            unit, kind, gears = shifts[log, number]
            found[unit][kind, gears, name].append(value)
    return {
        unit: {key: np.array(values) for key, values in sorted(found[unit].items())}
        for unit in sorted(found)
    }


def merge_figures(units: Iterable[FiguresByKind], most: int | None = None) -> FiguresByKind:
    """Merge the figures of several units.

    Parameters
    ----------
    units : figures of each
    most : largest number of values of a figure; quantiles at even steps stand for more

    Returns
    -------
    FiguresByKind
    """
    found: dict[tuple[ShiftKind, str, str], list[FloatArray]] = defaultdict(list)
    for one in units:
        for key, values in one.items():
            found[key].append(values)
    merged = {key: np.concatenate(parts) for key, parts in sorted(found.items())}
    return {
        key: values
        if most is None or values.size <= most
        else np.quantile(values, (np.arange(most) + 0.5) / most)
        for key, values in merged.items()
    }


def compare_units(units: Mapping[str, FiguresByKind]) -> list[tuple[str, FigureComparison]]:
    """Compare each unit with all others.

    Parameters
    ----------
    units : figures by unit

    Returns
    -------
    list of (str, FigureComparison)
        Unit, and the others against it; p-values are adjusted for all comparisons of the fleet.
    """
    names: list[str] = []
    found: list[FigureComparison] = []
    for unit, own in units.items():
        others = merge_figures((one for name, one in units.items() if name != unit), _MOST)
        compared = compare_figures(others, own)
        names += [unit] * len(compared)
        found += compared
    return list(zip(names, adjust_comparisons(found), strict=True))
