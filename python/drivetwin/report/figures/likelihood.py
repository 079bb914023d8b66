# SPDX-License-Identifier: MIT
"""Residuals of a likelihood fit over time, and sensitivity of its results to sensor errors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import Display, format_significant
from drivetwin.estimation.likelihood.coloured_noise import compute_block_means
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import (
    DELAY,
    FRICTION,
    SIZE,
    Sensitivity,
)
from drivetwin.estimation.result.estimate import Z95
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.figure import Figure, make_subplots, make_trace
from drivetwin.report.figures.stack import Curve, Panel, Phases, stack_panels
from drivetwin.report.labels import (
    get_channel_display,
    get_channel_label,
    get_channel_symbol,
    get_parameter_label,
)
from drivetwin.report.style import DIVERGING, FITTED, MEASURED, make_axis, make_layout

_SIGMA = Display("σ")


def plot_residuals(
    residuals: Mapping[str, tuple[FloatArray, FloatArray]], phases: Phases
) -> Figure:
    """Means of each output's residual over 20 ms blocks; of a right model 95 % lie in ±1.96 σ.

    `residuals` are those of one shift, as `compute_white_residuals` gives them.
    """
    panels = []
    for name, (time, white) in residuals.items():
        middle, means = compute_block_means(time, white)
        ends = middle[[0, -1]]
        bounds = [
            Curve("95 % of noise", ends, np.full(2, bound), FITTED, 1.0, "dash", listed=bound > 0.0)
            for bound in (-Z95, Z95)
        ]
        panels.append(
            Panel(
                get_channel_label(name), _SIGMA, [Curve("mean", middle, means, MEASURED), *bounds]
            )
        )
    return stack_panels(panels, phases, height=110 + 130 * len(panels))


_KINDS = {
    "gain": f"gain + {100 * SIZE:g} %",
    "offset": f"offset of {100 * SIZE:g} % of the largest",
    "delay": f"values {1e3 * DELAY:g} ms older",
}
"""Kinds of errors with their titles, from left to right."""
_FULL_COLOUR = 3.0
"""Change [% of the value] at which the colour is full; the number stands in the cell."""
_DOT = 0.05
"""Change below which a dot stands in place of a number."""
_FOLLOWING = {"matches": "y", "autorange": "reversed", "ticks": "", "showticklabels": False}
"""Axis of a panel whose rows are those of the first one."""
_UPRIGHT = 9
"""Letters of a sensor's name that fit above its column; longer ones are turned."""


def plot_sensitivity(found: Sensitivity) -> Figure:
    """Change of each result [%] by sensor: of gain errors, of offsets, of older values."""
    names = [_format_label(one, found) for one in found.ids]
    change = _scale_changes(found)
    symbols = [get_channel_symbol(error.rsplit(" ", 1)[0]) for error in found.errors]
    angle = -90 if max(map(len, symbols)) > _UPRIGHT else 0
    figure = make_subplots(len(_KINDS) * [1.0], gaps=(0.02, 0.0))
    for column, (kind, title) in enumerate(_KINDS.items(), start=1):
        chosen = [k for k, error in enumerate(found.errors) if error.endswith(kind)]
        figure.add_trace(
            make_trace(
                "heatmap",
                x=[_describe_sensor(found, k) for k in chosen],
                y=names,
                z=np.sign(change[:, chosen]) * np.sqrt(np.abs(change[:, chosen])),
                text=[[_format_number(value) for value in row] for row in change[:, chosen]],
                texttemplate="%{text}",
                zmin=-np.sqrt(_FULL_COLOUR),
                zmax=np.sqrt(_FULL_COLOUR),
                colorscale=DIVERGING,
                showscale=False,
                hovertemplate="%{y} by %{x}: %{text}<extra></extra>",
            ),
            row=1,
            col=column,
        )
        axis = make_axis(title, side="top", tickangle=angle, ticks="")
        figure.update_axes("x", axis, col=column)
    figure.merge_layout(
        **{
            **make_layout(170 + 27 * len(names)),
            "margin": {"l": 70, "r": 20, "t": 80, "b": 20},
            "yaxis": make_axis("", autorange="reversed", ticks=""),
        },
        **{f"yaxis{k}": _FOLLOWING for k in range(2, len(_KINDS) + 1)},
    )
    return figure


def _scale_changes(found: Sensitivity) -> FloatArray:
    """Change (q, e) in per cent of the value; of times in ms."""
    rows = [
        1e3 * change if _is_time(name) else _convert_to_percent(change, value)
        for name, value, change in zip(found.ids, found.values, found.change, strict=True)
    ]
    return np.array(rows)


def _is_time(result_id: str) -> bool:
    """Return True if a result is a time. A time may be zero, so its change is given in ms."""
    return get_parameter_spec(result_id).unit == "s"


def _convert_to_percent(change: FloatArray, value: float) -> FloatArray:
    """Convert a change (e,) to per cent of the value; undefined for 0 unless the change is 0."""
    if value == 0.0:
        return np.where(change == 0.0, 0.0, np.nan)
    return 100.0 * change / abs(value)


def _format_label(result_id: str, found: Sensitivity) -> str:
    if _is_time(result_id):
        return f"{get_parameter_label(result_id)} [ms]"
    if result_id.startswith(FRICTION):
        element = result_id.removeprefix(FRICTION)
        return f"μ ({element}) at {found.slips[element]:.0f} rad/s [%]"
    return f"{get_parameter_label(result_id)} [%]"


def _describe_sensor(found: Sensitivity, k: int) -> str:
    """Name of the sensor, and the size of its offset below it."""
    role, kind = found.errors[k].rsplit(" ", 1)
    if kind != "offset":
        return get_channel_symbol(role)
    display = get_channel_display(role)
    size = format_significant(found.sizes[k] * display.factor, 2)
    return f"{get_channel_symbol(role)}<br>{size}<br>{display.label}"


def _format_number(value: float) -> str:
    if not np.isfinite(value):
        return "–"
    if abs(value) < _DOT:
        return "·"
    return f"{value:+.{0 if abs(value) >= 9.95 else 1}f}".replace("-", "−")
