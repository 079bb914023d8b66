# SPDX-License-Identifier: MIT
"""A whole log with its shifts, and a shift with its four phases (paper Fig. 4)."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.display_units import BAR, NM, RPM, Display
from drivetwin.channels.roles import Quantity, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import (
    Curve,
    Panel,
    build_zoom_buttons,
    compute_full_range,
    compute_shift_view,
    plot_over_time_axis,
    shade_phases,
    stack_panels,
    write_above,
)
from drivetwin.report.labels import get_channel_label
from drivetwin.report.style import ACCENT, COMPARED, MEASURED, SECOND, SERIES
from drivetwin.shifts.shift import Shift

QUANTITIES: dict[Quantity, tuple[str, Display]] = {
    Quantity.TORQUE: ("torque", NM),
    Quantity.PRESSURE: ("pressure", BAR),
    Quantity.SPEED: ("speed", RPM),
    Quantity.FRACTION: ("share", Display("%", 100.0)),
    Quantity.TEMPERATURE: ("temperature", Display("K")),
    Quantity.STATE: ("state", Display("–")),
}
"""Axis title and unit of each quantity."""


def plot_log(log: ShiftLog, shifts: Sequence[Shift] = ()) -> Figure:
    """All channels by quantity; `shifts` are shaded and named, with a button for each.

    A shift is too short in a whole log for the numbers of its phases to stand side by side.
    """
    panels = build_log_panels(log)
    whole = compute_full_range(panels)
    names = [shift.name for shift in shifts]
    spans = [get_shift_spans(shift) for shift in shifts]
    zooms = {"whole": whole}
    for name, shift, span in zip(names, shifts, spans, strict=True):
        zooms[f"{name}, {shift.lockup_time:.1f} s"] = compute_shift_view(span)
    buttons = build_zoom_buttons(panels, zooms) if shifts else None
    figure = plot_over_time_axis(panels, whole, 120 + 170 * len(panels), buttons)
    for name, span in zip(names, spans, strict=True):
        shade_phases(figure, span)
        write_above(figure, 0.5 * (span["torque"][0] + span["inertia"][1]), name)
    return figure


def build_log_panels(log: ShiftLog) -> list[Panel]:
    """Return the panels of `plot_log`: one panel for each quantity in the log."""
    panels = []
    for quantity, (title, display) in QUANTITIES.items():
        channels = [one for one in log.channels.values() if one.quantity is quantity]
        if channels:
            curves = [_build_curve(one, k) for k, one in enumerate(channels)]
            panels.append(Panel(title, display, curves))
    return panels


def _build_curve(channel: Channel, k: int) -> Curve:
    held = channel.held or channel.quantity is Quantity.STATE
    return Curve(
        get_channel_label(channel.role),
        channel.time,
        channel.values,
        SERIES[k % len(SERIES)],
        step=held,
    )


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
    """Return the panels of `plot_shift_phases` from top to bottom, of the channels there are."""
    pressures = {
        make_pressure_role(shift.offgoing): (f"{shift.offgoing} (off-going)", COMPARED),
        make_pressure_role(shift.oncoming): (f"{shift.oncoming} (on-coming)", SECOND),
    }
    groups = (
        ("engine torque", NM, {"engine_torque": ("T_e", MEASURED)}, 0.8),
        ("pressure", BAR, pressures, 1.0),
        ("output torque", NM, {"output_torque": ("T_o", MEASURED)}, 1.3),
        *((title, RPM, speeds, 0.9) for title, speeds in _SPEEDS),
    )
    panels = []
    for title, display, roles, weight in groups:
        curves = [
            _build_measured_curve(name, log[role], colour)
            for role, (name, colour) in roles.items()
            if role in log
        ]
        if curves:
            panels.append(Panel(title, display, curves, weight))
    return panels


def get_shift_spans(shift: Shift) -> dict[str, tuple[float, float]]:
    """Intervals of the four phases [s]."""
    return {
        "before": shift.before,
        "torque": shift.torque_phase,
        "inertia": shift.inertia_phase,
        "after": (shift.lockup_time, shift.after[1]),
    }


def _build_measured_curve(name: str, channel: Channel, colour: str) -> Curve:
    return Curve(name, channel.time, channel.values, colour, step=channel.held)
