# SPDX-License-Identifier: MIT
"""Observed torques with their 95 % bands, over the measured torque if the log has one."""

from __future__ import annotations

from drivetwin._util.display_units import NM
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.observer.result import Band, FloatArray, Observation
from drivetwin.report.figures.stack import Curve, Panel
from drivetwin.report.style import MEASURED, SIMULATED

BAND_FILL, BAND_EDGE = "rgba(213,94,0,0.28)", "rgba(213,94,0,0.6)"
"""Area and edges of a band, in the colour of the curve within."""


def build_observer_panels(one: Observation, log: ShiftLog) -> list[Panel]:
    """Build a panel for each torque; add the measured output torque if the log has one."""
    panels = []
    for name, band in one.bands.items():
        curves = _build_band_curves(one.time, band)
        if name in log:
            channel = log[name]
            inside = (channel.time >= one.time[0]) & (channel.time <= one.time[-1])
            measured = Curve("measured", channel.time[inside], channel.values[inside], MEASURED)
            curves = [measured, *curves]
        panels.append(Panel(name.replace("_", " ").replace(".", " of "), NM, curves))
    return panels


def _build_band_curves(time: FloatArray, band: Band) -> list[Curve]:
    name, edge = "95 % band", BAND_EDGE
    return [
        Curve(name, time, band.lower, edge, width=0.7, listed=False, says="from"),
        Curve(name, time, band.upper, edge, width=0.7, fill=BAND_FILL, says="to"),
        Curve("observed", time, band.value, SIMULATED, width=1.6),
    ]
