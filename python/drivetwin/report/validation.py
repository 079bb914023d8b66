# SPDX-License-Identifier: MIT
"""Figures of recordings, of friction, and of simulation over measurement (paper Fig. 11)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import BAR, NM, RPM, Display, scale_display
from drivetwin.channels.roles import Quantity, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.result.estimate import FrictionCurve
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.report.figure import (
    ACCENT,
    BAND,
    COMPARED,
    FITTED,
    MEASURED,
    MUTED,
    OVER,
    SECOND,
    SERIES,
    SIMULATED,
    UNDER,
    Entry,
    Figure,
    get_channel_label,
    make_axis,
    make_layout,
    make_trace,
)
from drivetwin.report.stack import (
    MAX_POINTS,
    Curve,
    Panel,
    build_zoom_buttons,
    compute_full_range,
    compute_shift_view,
    mark_phases,
    plot_over_time_axis,
    shade_phases,
    stack_panels,
    write_above,
)
from drivetwin.shifts.shift import Shift


def plot_friction(element: str, curve: FrictionCurve) -> Figure:
    """Points, smoothed curve with band, and the fitted Stribeck law of one element."""
    figure = Figure()
    if curve.points_slip.size:
        stride = -(-curve.points_slip.size // MAX_POINTS)
        figure.add_scatter(
            x=curve.points_slip[::stride].astype("float32"),
            y=curve.points_mu[::stride].astype("float32"),
            mode="markers",
            name="points from the log",
            marker={"color": MEASURED, "size": 4, "opacity": 0.45},
        )
    bounds = draw_band(curve, BAND, name="95 % band, sensors and effects")
    if len(bounds.x):
        figure.add_trace(bounds)
    figure.add_scatter(
        x=curve.slip,
        y=curve.mu,
        mode="lines",
        name=f"curve of {element}",
        line={"color": FITTED, "width": 2.2},
    )
    if curve.stribeck is not None:
        figure.add_scatter(
            x=curve.slip,
            y=curve.stribeck.evaluate(curve.slip),
            mode="lines",
            name="Stribeck law",
            line={"color": COMPARED, "width": 1.6, "dash": "dash"},
        )
    figure.set_layout(
        make_layout(
            420,
            xaxis=make_axis(f"|slip| of {element} [rad/s]", rangemode="tozero"),
            yaxis=make_axis(
                f"friction coefficient {curve.symbol} [–]", range=_compute_mu_range(curve)
            ),
            hovermode="x",
        )
    )
    return figure


def draw_band(curve: FrictionCurve, colour: str, **options: Any) -> Entry:
    """Area between the bounds of a curve; empty if the curve has no bounds."""
    known = np.isfinite(curve.mu_lo) & np.isfinite(curve.mu_hi)
    slip = curve.slip[known]
    return make_trace(
        "scatter",
        x=np.concatenate((slip, slip[::-1])),
        y=np.concatenate((curve.mu_hi[known], curve.mu_lo[known][::-1])),
        mode="lines",
        fill="toself",
        fillcolor=colour,
        line={"width": 0},
        hoverinfo="skip",
        **options,
    )


def _compute_mu_range(curve: FrictionCurve) -> tuple[float, float]:
    """Range that shows curve and band whole; stray points at vanishing pressure may lie outside."""
    values = np.concatenate((curve.mu, curve.mu_lo, curve.mu_hi))
    values = values[np.isfinite(values)]
    middle = curve.points_mu[np.isfinite(curve.points_mu)]
    if middle.size:
        values = np.concatenate((values, np.percentile(middle, [10, 90])))
    low, high = float(values.min()), float(values.max())
    margin = 0.15 * (high - low) + 0.002
    return low - margin, high + margin


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
            (Curve(name, log[role].time, log[role].values, colour, step=log[role].held))
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


OUTPUTS: Mapping[str, tuple[str, Display, float]] = {
    "output_torque": ("output torque", NM, 1.6),
    "input_speed": ("input speed", RPM, 1.1),
    "output_speed": ("output speed", RPM, 1.1),
    "engine_speed": ("engine speed", RPM, 1.1),
    "wheel_speed": ("wheel speed", RPM, 1.1),
}
"""Compared signals: axis title, unit and panel height."""
_OVERVIEW = ("output_torque", "input_speed", "output_speed")
_OVERVIEW_PANELS = 2


def plot_validation(validation: Validation) -> Figure:
    """Inputs that drove the model, then each output as measured and as simulated."""
    return stack_panels(build_validation_panels(validation), validation.phases, height=1180)


def build_validation_panels(validation: Validation) -> list[Panel]:
    """Return the panels of `plot_validation` from top to bottom."""
    shift = validation.shift
    torque = validation.engine_torque
    pressures = [
        Curve(name, validation.pressures[name].time, validation.pressures[name].values, colour)
        for name, colour in ((shift.offgoing, COMPARED), (shift.oncoming, SECOND))
    ]
    panels = [
        Panel("engine torque", NM, [Curve("T_e", torque.time, torque.values, MEASURED)], 0.7),
        Panel("pressure", BAR, pressures, 0.7),
    ]
    for name, (title, display, weight) in OUTPUTS.items():
        if name in validation.traces:
            trace = validation.traces[name]
            shown = _scale_panel(trace, display)
            panels.append(Panel(title, shown, build_pair(trace), weight))
            panels.append(Panel("residual", shown, [_build_residual(trace)], 0.5))
    return panels


def plot_overview(validation: Validation) -> Figure:
    """The first two signals that were compared through the shift, simulated over measured."""
    names = [name for name in _OVERVIEW if name in validation.traces][:_OVERVIEW_PANELS]
    panels = [
        Panel(OUTPUTS[name][0], _scale_panel(trace, OUTPUTS[name][1]), build_pair(trace))
        for name, trace in ((name, validation.traces[name]) for name in names)
    ]
    view = compute_shift_view(validation.phases)
    figure = plot_over_time_axis(panels, view, height=80 + 120 * len(panels))
    mark_phases(figure, validation.phases)
    return figure


def plot_further_signals(validation: Validation) -> Figure:
    """Slip of both shift elements, and signals that are not part of the fit; empty for none."""
    panels = list(_build_slip_panels(validation))
    for name, trace in validation.extra_traces.items():
        title, display, weight = OUTPUTS[name]
        panels.append(Panel(title, display, build_pair(trace), weight))
        panels.append(Panel("residual", display, [_build_residual(trace)], 0.5))
    if not panels:
        return Figure()
    height = 110 + 140 * sum(panel.weight for panel in panels)
    return stack_panels(panels, validation.phases, height=round(height))


def _build_slip_panels(validation: Validation) -> Iterator[Panel]:
    """Slip of each element (eq. 15), measured where both speeds of the gearbox are."""
    run, traces = validation.trajectory, validation.traces
    for element in validation.model.elements:
        if element.name not in run.slip:
            continue
        curves = [Curve("simulated", run.time, run.slip[element.name], SIMULATED, UNDER)]
        if "input_speed" in traces and "output_speed" in traces:
            inlet, outlet = traces["input_speed"], traces["output_speed"]
            behind = np.interp(inlet.time, outlet.time, outlet.measured)
            slip: FloatArray = inlet.measured / element.i_c - element.i_out * behind
            curves.append(Curve("measured", inlet.time, slip, MEASURED, OVER))
        yield Panel(f"slip of {element.name}", RPM, curves)


def build_pair(trace: SignalTrace) -> list[Curve]:
    """Simulation as a broad line, and the measurement as a thin one over it."""
    return [
        Curve("simulated", trace.time, trace.simulated, SIMULATED, UNDER),
        Curve("measured", trace.time, trace.measured, MEASURED, OVER),
    ]


def _scale_panel(trace: SignalTrace, display: Display) -> Display:
    known = trace.measured[np.isfinite(trace.measured)]
    return scale_display(display, float(np.abs(known).max(initial=0.0)))


def _build_residual(trace: SignalTrace) -> Curve:
    return Curve("measured − simulated", trace.time, trace.measured - trace.simulated, MUTED, 1.0)
