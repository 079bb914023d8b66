# SPDX-License-Identifier: MIT
"""Figures of a calibration: profiles and motion over the spread band, distributions of metrics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.display_units import BAR, NM, Display, get_display_unit
from drivetwin.calibration.calibrate import Assessment, Calibration
from drivetwin.calibration.evaluate import Plant, get_vehicle_inertias
from drivetwin.calibration.metrics import METRICS, Metric, compute_acceleration
from drivetwin.calibration.objective import Statistic
from drivetwin.report.figure import Entry, Figure, make_subplots, make_trace
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.style import ACCENT, MEASURED, MUTED, SIMULATED, make_axis, make_layout
from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Output

_DRAWN = 200
"""Runs behind a band."""
_BAND = (2.5, 97.5)
"""Percentiles of a band, 95 % of the units."""
_COLOURS = {"before": MUTED, "after": SIMULATED}
_FILLS = {"before": "rgba(138,143,152,0.20)", "after": "rgba(213,94,0,0.20)"}
_ACCELERATION = Display("m/s²")
_SPEED = Display("rad/s")
_COLUMNS = 2
_SECONDS = Display("s")


@dataclass(frozen=True, eq=False)
class _Band:
    """Median and 95 % band (n,) of a signal over the units."""

    low: FloatArray
    middle: FloatArray
    high: FloatArray


def plot_profiles(found: Calibration) -> Figure:
    """Profiles before and after, with acceleration and slip over the spread band.

    Time counts from the request.
    """
    shift = found.task.maneuver
    time = shift.time - shift.request
    parts = {"before": found.before, "after": found.after}
    bands = {name: _simulate_bands(found, one) for name, one in parts.items()}
    pressures = [
        Curve(
            f"{label} {name}",
            time,
            _sample(getattr(one.profiles, key), shift.time),
            MEASURED if key == "offgoing" else ACCENT,
            dash="dot" if name == "before" else "solid",
        )
        for name, one in parts.items()
        for key, label in (("offgoing", shift.offgoing.name), ("oncoming", shift.oncoming.name))
    ]
    torques = [
        Curve(name, time, _sample(one.profiles.engine_torque, shift.time), _COLOURS[name])
        for name, one in parts.items()
    ]
    panels = [
        Panel("pressure", BAR, pressures, weight=1.3),
        Panel("engine torque", NM, torques, weight=0.8),
        Panel("acceleration", _ACCELERATION, _draw_bands(time, bands, 0), weight=1.3),
        Panel(f"slip of {shift.oncoming.name}", _SPEED, _draw_bands(time, bands, 1)),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 820)


def plot_distributions(found: Calibration) -> Figure:
    """Histogram of each metric before and after over the fresh draws; limits as lines."""
    names = list(Metric)
    rows = -(-len(names) // _COLUMNS)
    titles = [f"{METRICS[one].label} [{get_metric_display(one).label}]" for one in names]
    figure = make_subplots(_COLUMNS * [1.0], rows * [1.0], gaps=(0.1, 0.5 / rows), titles=titles)
    for k, metric in enumerate(names):
        place = {"row": k // _COLUMNS + 1, "col": k % _COLUMNS + 1}
        for part, one in (("before", found.before), ("after", found.after)):
            values = get_metric_display(metric).to_display(one.outcome.values[metric])
            figure.add_trace(_build_histogram(part, values, listed=k == 0), **place)
        for limit in found.task.limits:
            if limit.metric is metric:
                at = limit.bound * get_metric_display(metric).factor
                dash = "dash" if limit.statistic is Statistic.MEAN else "solid"
                figure.add_vline(x=at, line={"color": MEASURED, "dash": dash}, **place)
    figure.merge_layout(**make_layout(210 * rows, barmode="overlay"))
    figure.merge_layout(margin={"t": 70}, legend={"y": 1.04})
    figure.update_axes("y", make_axis("", showticklabels=False))
    return figure


def get_metric_display(metric: Metric) -> Display:
    """Return the display unit of a metric; times are shown in seconds."""
    unit = METRICS[metric].unit
    return _SECONDS if unit == "s" else get_display_unit(unit)


def _build_histogram(name: str, values: FloatArray, *, listed: bool) -> Entry:
    return make_trace(
        "histogram",
        x=values.astype("float32"),
        name=name,
        nbinsx=60,
        histnorm="probability",
        opacity=0.6,
        marker={"color": _COLOURS[name]},
        legendgroup=name,
        showlegend=listed,
    )


def _sample(signal: Signal, time: FloatArray) -> FloatArray:
    return np.interp(time, signal.time, signal.values)


def _simulate_bands(found: Calibration, one: Assessment) -> tuple[_Band, _Band]:
    """Bands of the vehicle's acceleration change and of the on-coming element's slip."""
    shift = found.task.maneuver
    draws = found.fresh.select(slice(0, _DRAWN))
    outputs: tuple[Output, ...] = (shift.body.drive, ("slip", shift.oncoming.name))
    runs = Plant(shift, found.task.settings.threads, ()).simulate(one.control, draws, outputs)
    columns = runs.columns
    vehicle = get_vehicle_inertias(shift, draws)
    acceleration = compute_acceleration(shift, columns[:, 0], vehicle)
    return _compute_band(acceleration), _compute_band(columns[:, 1])


def _compute_band(values: FloatArray) -> _Band:
    low, middle, high = np.nanpercentile(values, (_BAND[0], 50.0, _BAND[1]), axis=0)
    return _Band(low, middle, high)


def _draw_bands(time: FloatArray, bands: dict[str, tuple[_Band, _Band]], which: int) -> list[Curve]:
    curves = []
    for name, both in bands.items():
        one, colour = both[which], _COLOURS[name]
        curves += [
            Curve(f"{name}, 2.5 %", time, one.low, colour, width=0.5, listed=False),
            Curve(f"{name}, 97.5 %", time, one.high, colour, width=0.5, listed=False,
                  fill=_FILLS[name]),
            Curve(name, time, one.middle, colour),
        ]  # fmt: skip
    return curves
