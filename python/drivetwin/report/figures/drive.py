# SPDX-License-Identifier: MIT
"""Figures of a whole drive: the motion, one shift of it, the energy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import plotly.graph_objects as go

from drivetwin._util.display_units import BAR, NM, RPM, Display
from drivetwin.drive.result import DriveRun, Maneuver
from drivetwin.report.figures.stack import Curve, Panel, over_time, whole
from drivetwin.report.style import (
    ACCENT,
    COMPARED,
    MEASURED,
    MUTED,
    SECOND,
    SIMULATED,
    axis,
    layout,
)
from drivetwin.simulation.dual_clutch import FloatArray

_COLOURS = (MEASURED, SIMULATED, COMPARED, SECOND, ACCENT, MUTED)
_RATIO = Display("–")
_BEFORE, _AFTER = 0.1, 0.6
"""What a figure of one shift shows around it, s."""


def motion_figure(run: DriveRun) -> go.Figure:
    """Speeds, torques, converter and pressures over the whole drive."""
    panels = motion_panels(run)
    return over_time(panels, whole(panels), 760)


def motion_panels(run: DriveRun) -> list[Panel]:
    """Return the panels of `motion_figure` from top to bottom."""
    time = run.time
    return [
        Panel("speed", RPM, _speeds(run, slice(None)), weight=1.3),
        Panel("torque", NM, _torques(run, slice(None)), weight=1.3),
        Panel(
            "converter",
            _RATIO,
            [
                Curve("speed ratio", time, run.speed_ratio, MEASURED),
                Curve("torque ratio", time, run.torque_ratio, SIMULATED),
                Curve("pedal", time, run.pedal, MUTED, dash="dot"),
            ],
        ),
        Panel("pressure", BAR, _by_element(run.pressure, time, slice(None), run.pressure)),
    ]


def shift_figure(run: DriveRun, maneuver: Maneuver) -> go.Figure:
    """One shift: input speed, output torque, pressures and friction power of both elements."""
    panels = maneuver_panels(run, maneuver)
    return over_time(panels, whole(panels), 560)


def maneuver_panels(run: DriveRun, maneuver: Maneuver) -> list[Panel]:
    """Return the panels of `shift_figure` from top to bottom."""
    action = maneuver.action
    first, last = np.searchsorted(run.time, (action.start - _BEFORE, action.end + _AFTER))
    inside = slice(int(first), int(last))
    time = run.time[inside]
    power = {name: run.slip[name] * run.torque[name] for name in action.elements}
    return [
        Panel("speed", RPM, _speeds(run, inside)[:2]),
        Panel("torque", NM, _torques(run, inside)),
        Panel("pressure", BAR, _by_element(run.pressure, time, inside, action.elements)),
        Panel("power", Display("kW", 1e-3), _by_element(power, time, inside, power)),
    ]


def energy_figure(run: DriveRun) -> go.Figure:
    """Friction work by element and converter heat as bars."""
    parts = {"torque converter": run.audit.converter, **run.work}
    figure = go.Figure(
        go.Bar(
            x=[value / 1e3 for value in parts.values()],
            y=list(parts),
            orientation="h",
            marker={"color": MEASURED},
            hovertemplate="%{y}: %{x:.1f} kJ<extra></extra>",
        )
    )
    options = {"xaxis": axis("heat [kJ]"), "yaxis": axis("", autorange="reversed")}
    figure.update_layout(layout(120 + 30 * len(parts), **options))
    return figure


def _speeds(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    return [
        Curve("engine", time, run.engine_speed[inside], MEASURED),
        Curve("gearbox input", time, run.input_speed[inside], SIMULATED),
        Curve("gearbox output", time, run.output_speed[inside], COMPARED),
    ]


def _torques(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    return [
        Curve("output shaft", time, run.shaft_torque[inside], SIMULATED),
        Curve("engine", time, run.engine_torque[inside], MEASURED),
    ]


def _by_element(
    values: Mapping[str, FloatArray], time: FloatArray, inside: slice, names: Iterable[str]
) -> list[Curve]:
    return [
        Curve(name, time, values[name][inside], _COLOURS[index % len(_COLOURS)])
        for index, name in enumerate(names)
    ]
