# SPDX-License-Identifier: MIT
"""Zoom of figures over time, and sliders with the simulation that follows them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from drivetwin._util.display_units import Display, get_display_unit
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.result.validation import Validation
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import make_link
from drivetwin.report.figure import COMPARED, Figure, encode_entries, get_parameter_name
from drivetwin.report.stack import Curve, Panel, decimate_around, stack_panels
from drivetwin.report.validation import build_validation_panels
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import ADDED_ELEMENT_IDS
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.twin.distribution import scale_friction
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import rerun_shift, simulate_shift


def parse_number(value: object) -> float | None:
    """Return a finite number; None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


View = tuple[float, float]
"""First and last time [s] of a figure."""


def parse_view(change: Mapping[str, object]) -> View | None:
    """Return the time window of a relayout event [s]; None if the window did not change."""
    both = change.get("xaxis.range")
    ends = both if isinstance(both, list) else [change.get(f"xaxis.range[{k}]") for k in (0, 1)]
    numbers = [number for one in ends if (number := parse_number(one)) is not None]
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        return None
    return numbers[0], numbers[1]


def collect_curves(panels: Sequence[Panel], view: View) -> dict[int, dict[str, Any]]:
    """Collect x and y of every trace of stacked panels, fine in `view`, by trace index."""
    pairs = ((panel.display, curve) for panel in panels for curve in panel.curves)
    return encode_curves(enumerate(pairs), view)


def encode_curves(
    curves: Iterable[tuple[int, tuple[Display, Curve]]], view: View
) -> dict[int, dict[str, Any]]:
    """Encode curves by trace index, packed."""
    found = {}
    for place, (display, curve) in curves:
        time, recorded = decimate_around(curve.time, curve.values, view)
        values = display.to_display(recorded)
        found[place] = {"x": encode_entries(time), "y": encode_entries(values)}
    return found


BESIDE_MODEL = ("te_delay", *ADDED_ELEMENT_IDS)
"""Parameters of a simulation that the dual-clutch model does not have."""
FRICTION = "mu."
"""Prefix of the slider that scales the friction of an element; 1 as identified."""
_SPAN, _SIGMAS = 0.4, 6.0
"""A slider reaches so far to either side: a share of the value, or standard deviations."""
_DELAY_SPAN = 0.03
_POSITIONS = 500
"""A slider has at least so many positions."""
_FOLLOWING = ("simulated", "measured − simulated")
"""Names of the curves that a slider moves."""
_HEIGHT = 980


@dataclass(frozen=True)
class Slider:
    """One adjustable parameter: its identified value, range and unit.

    Numbers are in the display unit and multiples of `step`, so that they read well.
    """

    id: str
    label: str
    unit: str
    value: float
    low: float
    high: float
    step: float
    half_width: float | None = None
    """Half of the 95 % interval of the identified value; None without one."""

    @classmethod
    def from_range(
        cls, id: str, label: str, unit: str, range: tuple[float, float, float]
    ) -> Slider:
        """A slider over (low, value, high), rounded to its step."""
        step = 10.0 ** math.floor(math.log10((range[2] - range[0]) / _POSITIONS))
        low, value, high = (float(f"{round(x / step) * step:.12g}") for x in range)
        return cls(id, label, unit, value, low, high, step)


def list_sliders(twin: Twin, shift: Shift) -> list[Slider]:
    """List the sliders of a shift's simulation: its identifiable parameters."""
    inertia = f"J_prime_{twin.select_inertia_gear(shift)}"
    names = ("eta", inertia, "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o")
    elements = (shift.offgoing, shift.oncoming)
    ids = (*names, *BESIDE_MODEL, *(f"P0.{element}" for element in elements))
    sliders = [_build_slider(twin, name) for name in ids]
    laws = [
        Slider.from_range(
            FRICTION + element, f"Friction μ {element}", "× identified", (0.5, 1.0, 1.5)
        )
        for element in elements
    ]
    return [one for one in sliders if one is not None] + laws


def get_display(slider_id: str) -> Display:
    """Return the display format of a slider's number; friction factors stay unscaled."""
    if slider_id.startswith(FRICTION):
        return Display("× identified")
    return get_display_unit(get_parameter_spec(slider_id).unit)


def build_model(twin: Twin, shift: Shift, changes: Mapping[str, float]) -> DualClutch:
    """Build the model of a shift with some parameters changed (SI, by slider id).

    Raises MissingParameterError if a parameter was not identified and has no replacement.
    """
    overrides = {
        name: value
        for name, value in changes.items()
        if name not in BESIDE_MODEL and not name.startswith(FRICTION)
    }
    model = twin.build_dual_clutch(shift, overrides=overrides)
    elements = tuple(
        scale_friction(element, changes.get(FRICTION + element.name, 1.0))
        for element in model.elements
    )
    return replace(model, elements=elements)


def collect_changes(sliders: Sequence[Slider], positions: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters (SI) by slider id that differ from their identified values."""
    return {
        one.id: positions[one.id] / get_display(one.id).factor
        for one in sliders
        if one.id in positions and abs(positions[one.id] - one.value) > 0.5 * one.step
    }


def simulate_identified(twin: Twin, log: ShiftLog, shift: Shift) -> Validation:
    """The shift with the parameters as identified. Raises as `build_model` and `validate` do."""
    return simulate_shift(twin, log, shift)


def simulate_changes(
    before: Validation, twin: Twin, log: ShiftLog, changes: Mapping[str, float]
) -> Validation:
    """The shift of `before` with parameters changed."""
    model = build_model(twin, before.shift, changes)
    return rerun_shift(before, _replace_values(twin, changes), log, model)


def plot_what_if(identified: Validation, present: Validation) -> Figure:
    """Simulation over measurement; where parameters are changed also the one as identified."""
    panels = build_what_if_panels(identified, present)
    figure = stack_panels(panels, present.phases, height=_HEIGHT)
    figure.merge_layout(uirevision=make_link(present.shift))
    return figure


def build_what_if_panels(identified: Validation, present: Validation) -> list[Panel]:
    """Return the panels of `plot_what_if` from top to bottom: moved outputs, then inputs."""
    panels = sorted(build_validation_panels(present), key=lambda panel: not _follows(panel))
    return [_add_identified(panel, identified) for panel in panels]


def _follows(panel: Panel) -> bool:
    """Return True if a curve of the panel follows the sliders."""
    return any(curve.name in _FOLLOWING for curve in panel.curves)


def collect_changed_curves(
    figure: Figure, present: Validation, view: View | None = None
) -> dict[int, dict[str, Any]]:
    """Collect new x and y of the traces of `plot_what_if` that follow the sliders, by trace index.

    They are fine in `view` [s]; None: the view on which the figure opens.
    """
    curves = [
        (panel.display, curve)
        for panel in build_validation_panels(present)
        for curve in panel.curves
        if curve.name in _FOLLOWING
    ]
    places = [k for k, trace in enumerate(figure.data) if trace.name in _FOLLOWING]
    opening = figure.layout.xaxis.range
    shown = view or (opening[0], opening[1])
    return encode_curves(zip(places, curves, strict=True), shown)


def _build_slider(twin: Twin, name: str) -> Slider | None:
    estimate = twin.parameters.get(name)
    if estimate is None or estimate.value is None:
        return None
    spec, display, value = get_parameter_spec(name), get_display_unit(estimate.unit), estimate.value
    span = max(_SPAN * abs(value), _SIGMAS * (estimate.std_total or 0.0))
    if spec.stem == "te_delay":
        span = _DELAY_SPAN
    low, high = max(value - span, spec.lower), min(value + span, spec.upper)
    shown = (low * display.factor, value * display.factor, high * display.factor)
    slider = Slider.from_range(name, get_parameter_name(name), display.label, shown)
    interval = estimate.ci95_total
    if interval is None:
        return slider
    return replace(slider, half_width=0.5 * (interval[1] - interval[0]) * display.factor)


def _replace_values(twin: Twin, changes: Mapping[str, float]) -> Twin:
    """Return the twin with the sliders' values of the parameters beside the model."""
    changed = {
        name: replace(twin.parameters[name], value=changes[name])
        for name in BESIDE_MODEL
        if name in changes and name in twin.parameters
    }
    return replace(twin, parameters={**twin.parameters, **changed})


def _add_identified(panel: Panel, identified: Validation) -> Panel:
    """A panel of measured and simulated with the run as identified behind the present one."""
    if not any(curve.name == "simulated" for curve in panel.curves):
        return panel
    name = panel.quantity.replace(" ", "_")
    trace = identified.traces[name]
    behind = Curve("as identified", trace.time, trace.simulated, COMPARED, 1.2, "dot")
    measured, simulated = panel.curves
    return replace(panel, curves=[measured, behind, simulated])
