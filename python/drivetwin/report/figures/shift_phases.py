# SPDX-License-Identifier: MIT
"""The shift with its four phases (paper Fig. 4)."""

from __future__ import annotations

from drivetwin._util.display_units import BAR, NM, RPM
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import Curve, Panel, stack_panels
from drivetwin.report.style import ACCENT, COMPARED, MEASURED, SECOND
from drivetwin.shifts.shift import Shift

_SPEEDS = (
    ("input speed", {"engine_speed": ("engine", ACCENT), "input_speed": ("gearbox", MEASURED)}),
    ("output speed", {"output_speed": ("gearbox output", COMPARED)}),
    ("wheel speed", {"wheel_speed": ("wheel", SECOND)}),
)
"""Speeds of one magnitude share an axis: title, and by role the curve with its colour."""


def plot_shift_phases(log: ShiftLog, shift: Shift) -> Figure:
    """Engine torque, pressures, output torque and speeds over time, as measured."""
    panels = build_shift_panels(log, shift)
    return stack_panels(panels, get_shift_spans(shift), height=120 + 130 * len(panels))


def build_shift_panels(log: ShiftLog, shift: Shift) -> list[Panel]:
    """Return the panels of `plot_shift_phases` from top to bottom."""
    pressures = [
        _build_curve(f"{shift.offgoing} (off-going)", log.get_pressure(shift.offgoing), COMPARED),
        _build_curve(f"{shift.oncoming} (on-coming)", log.get_pressure(shift.oncoming), SECOND),
    ]
    panels = [
        Panel("engine torque", NM, [_build_curve("T_e", log["engine_torque"], MEASURED)], 0.8),
        Panel("pressure", BAR, pressures),
    ]
    if "output_torque" in log:
        curve = _build_curve("T_o", log["output_torque"], MEASURED)
        panels.append(Panel("output torque", NM, [curve], 1.3))
    for title, speeds in _SPEEDS:
        curves = [
            _build_curve(name, log[role], colour)
            for role, (name, colour) in speeds.items()
            if role in log
        ]
        if curves:
            panels.append(Panel(title, RPM, curves, 0.9))
    return panels


def get_shift_spans(shift: Shift) -> dict[str, tuple[float, float]]:
    """Intervals of the four phases [s]."""
    return {
        "before": shift.before,
        "torque": shift.torque_phase,
        "inertia": shift.inertia_phase,
        "after": (shift.lockup_time, shift.after[1]),
    }


def _build_curve(name: str, channel: Channel, colour: str) -> Curve:
    return Curve(name, channel.time, channel.values, colour, step=channel.held)
