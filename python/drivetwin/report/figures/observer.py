# SPDX-License-Identifier: MIT
"""Observed torques with their 95 % bands, over what a sensor shows where the log has one."""

from __future__ import annotations

from drivetwin.display import NM
from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.observer.observed import Band, FloatArray, Observation
from drivetwin.report.figures.stack import Curve, Panel
from drivetwin.report.style import MEASURED, MUTED, SIMULATED


def observer_panels(one: Observation, log: ShiftLog) -> list[Panel]:
    """A panel for each torque; the output torque of the log is drawn beside where there is one."""
    panels = []
    for name, band in one.bands.items():
        curves = _curves(one.time, band)
        if name in log:
            channel = log[name]
            inside = (channel.time >= one.time[0]) & (channel.time <= one.time[-1])
            measured = Curve("measured", channel.time[inside], channel.values[inside], MEASURED)
            curves = [measured, *curves]
        panels.append(Panel(name.replace("_", " ").replace(".", " of "), NM, curves))
    return panels


def _curves(time: FloatArray, band: Band) -> list[Curve]:
    return [
        Curve("95 % low", time, band.lower, MUTED, width=0.8),
        Curve("95 % high", time, band.upper, MUTED, width=0.8),
        Curve("observed", time, band.value, SIMULATED, width=1.6),
    ]
