# SPDX-License-Identifier: MIT
"""Simulation over measurement with the residual of each output (paper Fig. 11)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import BAR, NM, RPM, Display, scale_display
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import (
    Curve,
    Panel,
    compute_shift_view,
    mark_phases,
    plot_over_time_axis,
    stack_panels,
)
from drivetwin.report.style import COMPARED, MEASURED, MUTED, OVER, SECOND, SIMULATED, UNDER

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
