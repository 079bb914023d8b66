# SPDX-License-Identifier: MIT
"""All channels of a log over time, one panel for each quantity."""

from __future__ import annotations

import plotly.graph_objects as go

from drivetwin.logs.shiftlog import Quantity, ShiftLog
from drivetwin.report.figures.stack import Curve, Panel, over_time
from drivetwin.report.style import ACCENT, COMPARED, MEASURED, MUTED, SECOND, SIMULATED
from drivetwin.report.units import BAR, NM, RPM, Display

_COLOURS = (MEASURED, SIMULATED, COMPARED, SECOND, ACCENT, MUTED)
_DISPLAYS = {
    Quantity.TORQUE: NM,
    Quantity.PRESSURE: BAR,
    Quantity.SPEED: RPM,
    Quantity.FRACTION: Display("%", 100.0),
    Quantity.TEMPERATURE: Display("K"),
    Quantity.STATE: Display("–"),
}
_PANEL_HEIGHT = 170


def channels_figure(log: ShiftLog) -> go.Figure:
    """Every mapped channel by its role, over the whole log."""
    panels = []
    for quantity, display in _DISPLAYS.items():
        shown = [one for one in log.channels.values() if one.quantity is quantity]
        curves = [
            Curve(
                one.role.replace("_", " ").replace("pressure.", ""),
                one.time,
                one.values,
                _COLOURS[number % len(_COLOURS)],
                step=one.held or quantity is Quantity.STATE,
            )
            for number, one in enumerate(shown)
        ]
        if curves:
            panels.append(Panel(quantity.value, display, curves))
    times = [one.time for one in log.channels.values()]
    view = (min(float(t[0]) for t in times), max(float(t[-1]) for t in times))
    return over_time(panels, view, 80 + _PANEL_HEIGHT * len(panels))
