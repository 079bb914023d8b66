# SPDX-License-Identifier: MIT
"""Figures of a whole drive: the motion, one shift of it, the energy."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from drivetwin._util.display_units import BAR, NM, RPM, Display
from drivetwin.drive.result import DriveRun, Maneuver
from drivetwin.report.figure import Figure, make_trace
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.style import (
    ACCENT,
    COMPARED,
    MEASURED,
    MUTED,
    SECOND,
    SIMULATED,
    make_axis,
    make_layout,
)
from drivetwin.simulation.dual_clutch import FloatArray

_COLOURS = (MEASURED, SIMULATED, COMPARED, SECOND, ACCENT, MUTED)
_RATIO = Display("–")
_BEFORE, _AFTER = 0.1, 0.6
"""Time before and after a shift in its figure, s."""


def plot_motion(run: DriveRun) -> Figure:
    """Speeds, torques, converter and pressures over the whole drive."""
    panels = build_motion_panels(run)
    return plot_over_time_axis(panels, compute_full_range(panels), 760)


def build_motion_panels(run: DriveRun) -> list[Panel]:
    """Return the panels of `plot_motion` from top to bottom."""
    time = run.time
    return [
        Panel("speed", RPM, _build_speed_curves(run, slice(None)), weight=1.3),
        Panel("torque", NM, _build_torque_curves(run, slice(None)), weight=1.3),
        Panel(
            "converter",
            _RATIO,
            [
                Curve("speed ratio", time, run.speed_ratio, MEASURED),
                Curve("torque ratio", time, run.torque_ratio, SIMULATED),
                Curve("pedal", time, run.pedal, MUTED, dash="dot"),
            ],
        ),
        Panel(
            "pressure", BAR, _build_element_curves(run.pressure, time, slice(None), run.pressure)
        ),
    ]


def plot_maneuver(run: DriveRun, maneuver: Maneuver) -> Figure:
    """One shift: input speed, output torque, pressures and friction power of both elements."""
    panels = build_maneuver_panels(run, maneuver)
    return plot_over_time_axis(panels, compute_full_range(panels), 560)


def build_maneuver_panels(run: DriveRun, maneuver: Maneuver) -> list[Panel]:
    """Return the panels of `plot_maneuver` from top to bottom."""
    action = maneuver.action
    first, last = np.searchsorted(run.time, (action.start - _BEFORE, action.end + _AFTER))
    inside = slice(int(first), int(last))
    time = run.time[inside]
    power = {name: run.slip[name] * run.torque[name] for name in action.elements}
    return [
        Panel("speed", RPM, _build_speed_curves(run, inside)[:2]),
        Panel("torque", NM, _build_torque_curves(run, inside)),
        Panel("pressure", BAR, _build_element_curves(run.pressure, time, inside, action.elements)),
        Panel("power", Display("kW", 1e-3), _build_element_curves(power, time, inside, power)),
    ]


def plot_energy(run: DriveRun) -> Figure:
    """Friction work by element and converter heat as bars."""
    parts = {"torque converter": run.audit.converter, **run.work}
    figure = Figure(
        make_trace(
            "bar",
            x=[value / 1e3 for value in parts.values()],
            y=list(parts),
            orientation="h",
            marker={"color": MEASURED},
            hovertemplate="%{y}: %{x:.1f} kJ<extra></extra>",
        )
    )
    options = {"xaxis": make_axis("heat [kJ]"), "yaxis": make_axis("", autorange="reversed")}
    figure.set_layout(make_layout(120 + 30 * len(parts), **options))
    return figure


def _build_speed_curves(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    return [
        Curve("engine", time, run.engine_speed[inside], MEASURED),
        Curve("gearbox input", time, run.input_speed[inside], SIMULATED),
        Curve("gearbox output", time, run.output_speed[inside], COMPARED),
    ]


def _build_torque_curves(run: DriveRun, inside: slice) -> list[Curve]:
    time = run.time[inside]
    return [
        Curve("output shaft", time, run.shaft_torque[inside], SIMULATED),
        Curve("engine", time, run.engine_torque[inside], MEASURED),
    ]


def _build_element_curves(
    values: Mapping[str, FloatArray], time: FloatArray, inside: slice, names: Iterable[str]
) -> list[Curve]:
    return [
        Curve(name, time, values[name][inside], _COLOURS[index % len(_COLOURS)])
        for index, name in enumerate(names)
    ]
