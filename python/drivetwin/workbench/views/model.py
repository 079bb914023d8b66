# SPDX-License-Identifier: MIT
"""Model: sliders that move the simulation over the measurement, each with its lock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from dash import ALL, MATCH, Input, Output, Patch, State, html, no_update
from dash.development.base_component import Component

from drivetwin._util.display_units import format_significant
from drivetwin.errors import DrivetwinError, InputError, MissingParameterError
from drivetwin.report.stack import Panel
from drivetwin.report.summary import build_labelled_fits
from drivetwin.shifts.shift import make_shift_labels
from drivetwin.vehicle.locks import can_fix
from drivetwin.workbench.session import Live, Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import locks
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.export import Record
from drivetwin.workbench.views.fields import ControlId, Index, parse_positions
from drivetwin.workbench.views.log import Place, build_log_choice, register_log_choice
from drivetwin.workbench.views.stepper import Step
from drivetwin.workbench.views.widgets import render_table, replace_options
from drivetwin.workbench.what_if import (
    FRICTION,
    Slider,
    build_what_if_panels,
    collect_changes,
    get_display,
    list_sliders,
)

_BOTH = """(a, b) => {
  const typed = dash_clientside.callback_context.triggered_id || {};
  const given = typed.part === "number" ? b : a;
  const value = given === null || given === "" ? NaN : Number(given);
  const same = dash_clientside.no_update;
  return Number.isFinite(value) ? [value, value] : [same, same];
}"""


def layout() -> list[Component]:
    """Build the place of sliders and figure, which are filled when there is a twin."""
    return [
        ui.make_hint(
            "Move a slider: the measured engine torque and pressures drive the simulation with the "
            "changed parameter. The dotted curve is the model as identified."
        ),
        html.Div(id="model-content"),
    ]


def register(page: ui.Page) -> None:
    """Register sliders, the choice of the shift, and the next identification."""
    _register_bench(page)
    _register_sliders(page)
    locks.register(page)
    register_log_choice(page, Place.MODEL)
    ui.register_zoom(page, "model-plot", _get_model_panels)


def _get_model_panels(session: Session) -> list[Panel]:
    live = session.get_simulation()
    return build_what_if_panels(live.identified, live.present)


def _register_bench(page: ui.Page) -> None:
    @page.callback(Output("model-content", "children"), Input(ui.make_due_id("model"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """Render the sliders next to the figure."""
        work = session.work
        if work.result is None or not work.all_shifts:
            return []
        is_first = not work.has_viewed
        try:
            live = session.get_simulation()
        except (MissingParameterError, InputError) as incomplete:
            return [_build_choices(work), ui.make_hint(_explain(incomplete))]
        if is_first:
            ui.notify_topic(ui.Topic.STEPS)
        return _build_bench(session, live)

    @page.callback(Input("identify-again", "n_clicks"))
    def identify_again(session: Session, clicks: int | None) -> None:
        """Start the identification with the locks as set; the page goes to Identify."""
        if clicks:
            session.identify()
            ui.notify_topic(ui.Topic.RESULTS)

    @page.callback(Input("reset-sliders", "n_clicks"))
    def reset(session: Session, clicks: int | None) -> None:
        """Back to what was identified."""
        if clicks:
            session.update(lambda work: replace(work, changes={}))
            ui.notify_topic(ui.Topic.LIVE)

    @page.callback(Input("model-shift", "data-value"))
    def choose(session: Session, shift: Index | None) -> None:
        """Another shift."""
        if shift is not None and int(shift) != session.work.shift:
            session.update(lambda work: work.select_shift(int(shift)))
            ui.notify_topic(ui.Topic.PHASES)


def _register_sliders(page: ui.Page) -> None:
    page.app.clientside_callback(  # type: ignore[no-untyped-call]
        _BOTH,
        Output({"part": "range", "id": MATCH}, "value"),
        Output({"part": "number", "id": MATCH}, "value"),
        Input({"part": "range", "id": MATCH}, "value"),
        Input({"part": "number", "id": MATCH}, "value"),
        prevent_initial_call=True,
    )

    @page.callback(
        Output("model-plot", "figure"),
        Output("model-fit", "children"),
        Input({"part": "range", "id": ALL}, "value"),
        State({"part": "range", "id": ALL}, "id"),
    )
    def slide(
        session: Session, values: Sequence[float | str | None], ids: Sequence[ControlId]
    ) -> tuple[Any, Any]:
        """Simulate with the parameters of the sliders."""
        positions = parse_positions(values, [one.id for one in ids])
        work = session.work
        sliders = list_sliders(work.require_twin(), work.require_shift())
        changes = collect_changes(sliders, positions)
        if changes == work.changes:
            return no_update, no_update
        patch = Patch()
        for place, change in session.apply_sliders(changes).items():
            patch["data"][place]["x"] = change["x"]
            patch["data"][place]["y"] = change["y"]
        return patch, _build_fit(session.get_simulation())


def _build_choices(work: SessionState) -> Component:
    shifts = {str(k): name for k, name in enumerate(make_shift_labels(work.shifts))}
    return ui.make_row(
        *build_log_choice(work, Place.MODEL),
        ui.make_choice("model-shift", "Shift", shifts, str(work.shift)),
        ui.make_button("Reset the sliders", "reset-sliders"),
        html.Button(
            "Identify again with these locks",
            id="identify-again",
            type="button",
            **ui.make_attributes(data_go=Step.IDENTIFY.value),
        ),
        ui.make_button("Signals as CSV", {"export": Record.SIGNALS.value, "at": "model"}),
    )


def _build_bench(session: Session, live: Live) -> list[Component]:
    work = session.work
    twin = work.require_twin()
    sliders = list_sliders(twin, work.require_shift())
    others = [name for name in twin.parameters if name not in {one.id for one in sliders}]
    return [
        _build_choices(work),
        ui.make_hint(locks.HINT),
        html.Div(
            [
                html.Div([_build_slider(one, work) for one in sliders], className="sliders"),
                html.Div(
                    [
                        ui.make_graph(
                            "model-plot",
                            "Simulation over measurement",
                            live.figure,
                            cursors=True,
                        ),
                        html.Div(_build_fit(live), id="model-fit"),
                    ]
                ),
            ],
            className="bench",
        ),
        html.H3("Parameters without a slider"),
        locks.build_table(work, others),
    ]


def _build_slider(one: Slider, work: SessionState) -> Component:
    """Build a slider between the ends of its range, its number with the unit, and its lock."""
    value, changes = one.value, work.changes
    lock = (
        [locks.build_controls(work, one.id, locks.Place.SLIDER)]
        if (not one.id.startswith(FRICTION) and can_fix(one.id))
        else []
    )
    if one.id in changes:
        value = round(changes[one.id] * get_display(one.id).factor / one.step) * one.step
    limits = {"min": one.low, "max": one.high, "step": one.step, "value": value}
    return html.Div(
        [
            html.Div(
                [html.Span([html.B(one.label), f" {_format_identified(one)}"]), *lock],
                className="top",
            ),
            html.Div(
                [
                    html.Small(f"{one.low:g}"),
                    ui.make_field(
                        {"part": "range", "id": one.id},
                        f"{one.label}, slider",
                        hidden_label=True,
                        type="range",
                        **limits,
                    ),
                    html.Small(f"{one.high:g}"),
                    ui.make_field(
                        {"part": "number", "id": one.id},
                        f"{one.label}, number in {one.unit}",
                        hidden_label=True,
                        type="number",
                        debounce=True,
                        **limits,
                    ),
                    html.Small(one.unit),
                ],
                className="range",
            ),
        ],
        className="slider",
    )


def _format_identified(one: Slider) -> str:
    """Format the identified value with its 95 % interval; empty without one."""
    if one.half_width is None:
        return ""
    unit = "" if one.unit == "–" else f" {one.unit}"
    return f"{one.value:.6g} ± {format_significant(one.half_width, 2)}{unit}"


def _explain(fault: DrivetwinError) -> str:
    """Return cause and remedy as sentences in words of the page."""
    parts = [replace_options(part) for part in (fault.what, fault.remedy) if part]
    return " ".join(f"{part[0].upper()}{part[1:]}." for part in parts)


def _build_fit(live: Live) -> list[Component]:
    """Fit of the present run, and of the one as identified."""
    fits = {"now": live.present.fit, "as identified": live.identified.fit}
    parts = [render_table(build_labelled_fits(fits, "Fit by phase.", "model"))]
    status = live.present.status
    is_whole = status == "completed"
    return parts if is_whole else [*parts, ui.make_hint(f"the simulation ended early: {status}")]
