# SPDX-License-Identifier: MIT
"""Simulation over measurement with the residual of the output torque (paper Fig. 11)."""

from __future__ import annotations

from collections.abc import Mapping

import plotly.graph_objects as go

from drivetwin._util.display_units import BAR, NM, RPM, Display
from drivetwin.estimation.result.validation import SignalTrace, Validation
from drivetwin.report.figures.stack import Curve, Panel, stack_panels
from drivetwin.report.style import COMPARED, MEASURED, MUTED, SECOND, SIMULATED

OUTPUTS: Mapping[str, tuple[str, Display, float]] = {
    "output_torque": ("output torque", NM, 1.6),
    "input_speed": ("input speed", RPM, 1.1),
    "output_speed": ("output speed", RPM, 1.1),
}
"""Compared signals: axis title, unit and panel height."""


def plot_validation(validation: Validation) -> go.Figure:
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
            panels.append(Panel(title, display, _build_pair(trace), weight))
            panels.append(Panel("residual", display, [_build_residual(trace)], 0.5))
    return panels


def _build_pair(trace: SignalTrace) -> list[Curve]:
    return [
        Curve("measured", trace.time, trace.measured, MEASURED, width=2.4),
        Curve("simulated", trace.time, trace.simulated, SIMULATED, width=1.2),
    ]


def _build_residual(trace: SignalTrace) -> Curve:
    return Curve("measured − simulated", trace.time, trace.measured - trace.simulated, MUTED, 1.0)
