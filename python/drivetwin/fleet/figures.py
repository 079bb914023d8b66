# SPDX-License-Identifier: MIT
"""Figures of a fleet: a parameter over a field, units side by side, friction, shift quality."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import get_display_unit
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.fleet.mixed import Drift, JointEstimate
from drivetwin.fleet.rules import is_date, to_datetime
from drivetwin.fleet.store import ONE_FILE_EACH, Store
from drivetwin.fleet.task import RowKind
from drivetwin.report.figure import (
    ACCENT,
    BAND,
    FITTED,
    MEASURED,
    MUTED,
    Figure,
    get_parameter_label,
    make_axis,
    make_layout,
)
from drivetwin.shifts.summary import (
    SUMMARIZED,
    FigureComparison,
    FiguresByKind,
    adjust_comparisons,
    compare_figures,
)
from drivetwin.vehicle.spec import ShiftKind

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


_MOST_POINTS = 4000


def plot_drift(one: JointEstimate) -> Figure:
    """Every log over the first field, with the shared line, its 95 % band, and outliers.

    Of very many logs every n-th is drawn.
    """
    display = get_display_unit(one.si_unit)
    drift, points = one.drifts[0], one.points
    out = np.isin(points.value, [outlier.value for outlier in one.outliers])
    stride = -(-points.value.size // _MOST_POINTS)
    kept = np.arange(0, points.value.size, stride)
    figure = Figure()
    for name, picked, colour, symbol in (
        ("log", kept[~out[kept]], MEASURED, "circle"),
        ("outlier", np.flatnonzero(out), ACCENT, "x"),
    ):
        if picked.size:
            figure.add_scatter(
                x=_convert_readings(drift.field, points.reading[picked]),
                y=display.to_display(points.value[picked]),
                text=[points.unit[k] for k in picked],
                mode="markers",
                name=name,
                marker={"color": colour, "size": 9 if symbol == "x" else 5, "symbol": symbol,
                        "opacity": 0.45 if name == "log" else 1.0},
                hovertemplate="unit %{text}: %{y:.4g}<extra></extra>",
            )  # fmt: skip
    _add_line(figure, one, drift)
    figure.merge_layout(
        **make_layout(
            380,
            xaxis=make_axis(drift.field),
            yaxis=make_axis(
                f"{get_parameter_label(one.parameter)} [{display.label}]", exponentformat="e"
            ),
            hovermode="closest",
        )
    )
    return figure


def _add_line(figure: Figure, one: JointEstimate, drift: Drift) -> None:
    """The shared line through the reference, and the band of its level and slope together."""
    display = get_display_unit(one.si_unit)
    ends = np.linspace(np.min(one.points.reading), np.max(one.points.reading), 41)
    away = ends - drift.reference
    middle = one.value + drift.slope * away
    level = 0.5 * (one.ci95[1] - one.ci95[0])
    slope = 0.5 * (drift.ci95[1] - drift.ci95[0])
    half = np.hypot(level, slope * away)
    x = _convert_readings(drift.field, ends)
    figure.add_scatter(
        x=np.concatenate((x, x[::-1])),
        y=display.to_display(np.concatenate((middle + half, (middle - half)[::-1]))),
        fill="toself",
        fillcolor=BAND,
        line={"width": 0},
        name="95 % of the fleet's mean",
        hoverinfo="skip",
    )
    figure.add_scatter(
        x=x,
        y=display.to_display(middle),
        mode="lines",
        name="fleet",
        line={"color": FITTED, "width": 2.2},
    )


def plot_units(one: JointEstimate) -> Figure:
    """Plot the sorted deviations of the units with 95 % intervals; highlight the outliers."""
    display = get_display_unit(one.si_unit)
    units = sorted(one.units, key=lambda unit: unit.deviation)
    figure = Figure()
    for odd, colour, name in ((False, MEASURED, "unit"), (True, ACCENT, "beyond chance")):
        picked = [(k, unit) for k, unit in enumerate(units) if unit.odd is odd]
        if not picked:
            continue
        figure.add_scatter(
            x=[k for k, _ in picked],
            y=[unit.deviation * display.factor for _, unit in picked],
            error_y={
                "array": [Z95 * unit.std * display.factor for _, unit in picked],
                "color": MUTED,
                "thickness": 1,
                "width": 0,
            },
            text=[unit.unit for _, unit in picked],
            mode="markers",
            name=name,
            marker={"color": colour, "size": 6},
            hovertemplate="unit %{text}: %{y:.3g}<extra></extra>",
        )
    few = len(units) <= 80
    ticks = [unit.unit for unit in units] if few else None
    figure.merge_layout(
        **make_layout(
            340,
            xaxis=make_axis(
                "unit, from low to high",
                tickvals=list(range(len(units))) if few else None,
                ticktext=ticks,
                showticklabels=few,
                tickfont={"size": 9},
            ),
            yaxis=make_axis(
                f"deviation of {get_parameter_label(one.parameter)} [{display.label}]",
                exponentformat="e",  # a prefix μ would be taken for friction
            ),
            hovermode="closest",
        )
    )
    return figure


def _convert_readings(
    field: str, readings: FloatArray
) -> FloatArray | np.ndarray[tuple[int], np.dtype[np.object_]]:
    """Convert readings for plotting; date fields become dates."""
    if not is_date(field):
        return readings
    return np.array([to_datetime(each) for each in readings], dtype=object)
