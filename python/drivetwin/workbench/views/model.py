# SPDX-License-Identifier: MIT
"""Model: sliders that move the simulation over the measurement, and locks for the next run."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from dash import ALL, MATCH, Input, Output, Patch, State, ctx, html, no_update
from dash.development.base_component import Component

from drivetwin._util.display_units import format_uncertainty, get_display_unit
from drivetwin.errors import MissingParameterError
from drivetwin.estimation.result.estimate import Z95
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.validation import Validation
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.sections.parameters import TONES
from drivetwin.shifts.shift import make_shift_labels
from drivetwin.vehicle.locks import Lock, LockKind, can_fix
from drivetwin.workbench.locks import parse_lock
from drivetwin.workbench.session import Live, Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import (
    ControlId,
    Index,
    get_place,
    get_triggered_part,
    parse_positions,
)
from drivetwin.workbench.what_if import Slider, collect_changes, get_display, list_sliders

_KINDS = {kind.value: kind.value for kind in LockKind}
_BOTH = """(a, b) => {
  const typed = dash_clientside.callback_context.triggered_id || {};
  const given = typed.part === "number" ? b : a;
  const value = given === null || given === "" ? NaN : Number(given);
  const same = dash_clientside.no_update;
  return Number.isFinite(value) ? [value, value] : [same, same];
}"""


def layout() -> list[Component]:
    """Filled when there is a twin."""
    return [
        ui.make_hint(
            "Move a parameter: the simulation is driven by the measured engine torque and "
            "pressures again. The dotted curve is the model as identified."
        ),
        html.Div(id="model-content"),
        html.H3("Parameters and locks"),
        ui.make_hint(
            "free: the log alone decides. prior: value ± one standard deviation counts as a "
            "measurement. fixed: taken as known. Locks count from the next identification on."
        ),
        html.Div(id="locks-content"),
    ]


def register(page: ui.Page) -> None:
    """Sliders and locks."""
    _register_bench(page)
    _register_sliders(page)
    _register_locks(page)


def _register_bench(page: ui.Page) -> None:
    @page.callback(Output("model-content", "children"), Input(ui.make_due_id("model"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """Render the sliders next to the figure."""
        if session.work.method is None or not session.work.shifts:
            return [ui.make_hint("Nothing is identified yet.")]
        try:
            live = session.get_simulation()
        except MissingParameterError as incomplete:
            return [_build_choices(session.work), ui.make_hint(str(incomplete))]
        return _build_bench(session, live)

    @page.callback(Input("reset-sliders", "n_clicks"))
    def reset(session: Session, clicks: int | None) -> None:
        """Back to what was identified."""
        if clicks:
            session.choose_method(session.work.require_outcome().method)
            ui.notify_topic(ui.Topic.LIVE)

    @page.callback(Input("model-method", "data-value"), Input("model-shift", "data-value"))
    def choose(session: Session, method: Method | None, shift: Index | None) -> None:
        """Another result or shift."""
        work = session.work
        if method is not None and method is not work.method:
            session.choose_method(method)
            ui.notify_topic(ui.Topic.LIVE)
        if shift is not None and int(shift) != work.shift:
            session.choose_shift(int(shift))
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
        begun = time.perf_counter()
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
        spent = 1e3 * (time.perf_counter() - begun)
        return patch, _build_fit(
            session.get_simulation(), f"simulated and compared in {spent:.0f} ms"
        )


def _register_locks(page: ui.Page) -> None:
    @page.callback(Output("locks-content", "children"), Input(ui.make_due_id("model"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """One row for each parameter."""
        work = session.work
        return _build_locks(work) if work.shifts else [ui.make_hint("No shift is open.")]

    @page.callback(
        Input({"lock": "kind", "id": ALL}, "data-value"),
        Input({"lock": "value", "id": ALL}, "value"),
        Input({"lock": "std", "id": ALL}, "value"),
        State({"lock": "kind", "id": ALL}, "id"),
    )
    def lock(
        session: Session,
        kinds: Sequence[LockKind],
        values: Sequence[float | None],
        stds: Sequence[float | None],
        ids: Sequence[ControlId],
    ) -> None:
        """A lock was changed by hand."""
        if not ctx.triggered_id:
            return
        name = get_triggered_part("id")
        place = get_place(name, ids)
        wanted = parse_lock(name, kinds[place], values[place], stds[place])
        if _is_same(wanted, session.work.get_lock(name)):
            ui.notify("")
            return
        session.set_lock(name, wanted)
        ui.notify(
            f"{get_parameter_label(name)} is {wanted.kind.value} from the next identification on"
        )


def _is_same(one: Lock, other: Lock) -> bool:
    if one.kind is not other.kind or one.kind is LockKind.FREE:
        return one.kind is other.kind
    near = abs(one.value - other.value) <= 1e-5 * abs(other.value)
    return near and abs(one.std - other.std) <= 1e-5 * abs(other.std)


def _build_choices(work: SessionState) -> Component:
    methods = {method.value: method.value for method in work.results}
    shifts = {str(k): name for k, name in enumerate(make_shift_labels(work.shifts))}
    shown = work.require_outcome().method.value
    return ui.make_row(
        ui.make_choice("model-method", "Result", methods, shown),
        ui.make_choice("model-shift", "Shift", shifts, str(work.shift)),
        ui.make_button("As identified", "reset-sliders"),
    )


def _build_bench(session: Session, live: Live) -> list[Component]:
    work = session.work
    sliders = list_sliders(work.require_twin(), work.require_shift())
    return [
        _build_choices(work),
        html.Div(
            [
                html.Div(
                    [_build_slider(one, work.changes) for one in sliders], className="sliders"
                ),
                html.Div(
                    [
                        html.Div(_build_fit(live, ""), id="model-fit"),
                        ui.make_graph("model-plot", "Simulation over measurement", live.figure),
                    ]
                ),
            ],
            className="bench",
        ),
    ]


def _build_slider(one: Slider, changes: Mapping[str, float]) -> Component:
    value = one.value
    if one.id in changes:
        value = round(changes[one.id] * get_display(one.id).factor / one.step) * one.step
    limits = {"min": one.low, "max": one.high, "step": one.step, "value": value}
    return html.Div(
        [
            html.Div([one.label, html.Small(one.unit)], className="name"),
            ui.make_field(
                {"part": "range", "id": one.id},
                f"{one.label}, slider",
                hidden_label=True,
                type="range",
                **limits,
            ),
            ui.make_field(
                {"part": "number", "id": one.id},
                f"{one.label}, number in {one.unit}",
                hidden_label=True,
                type="number",
                debounce=True,
                **limits,
            ),
        ],
        className="slider",
    )


def _build_fit(live: Live, remark: str) -> list[Component]:
    """Fit of the present run, and of the one as identified."""
    rows = [
        (
            name.replace("_", " "),
            _format_percent(live.present, name),
            _format_percent(live.identified, name),
        )
        for name in live.present.fit
    ]
    parts = [ui.make_table(("fit over the whole shift", "now", "as identified"), rows)]
    status = live.present.status
    text = remark if status == "completed" else f"the simulation ended early: {status}"
    return [*parts, ui.make_hint(text)]


def _format_percent(run: Validation, name: str) -> str:
    return f"{run.fit[name]['all'].fit_percent:.2f} %"


def _build_locks(work: SessionState) -> list[Component]:
    names = list(work.require_twin().parameters) if work.method else _list_default_ids(work)
    head = ("parameter", "value", "± 95 %", "unit", "verdict", "lock", "at", "± std")
    return [ui.make_table(head, [_build_lock_row(work, name) for name in names], name="locks")]


def _list_default_ids(work: SessionState) -> list[str]:
    """List the parameters that can be fixed before an identification."""
    gears = dict.fromkeys(g for s in work.shifts for g in (s.start_gear, s.end_gear))
    elements = dict.fromkeys(e for s in work.shifts for e in (s.offgoing, s.oncoming))
    return [
        "eta",
        *(f"J_prime_{gear}" for gear in gears),
        *("J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay"),
        *(f"P0.{element}" for element in elements),
    ]


def _build_lock_row(work: SessionState, name: str) -> list[Any]:
    spec = get_parameter_spec(name)
    display = get_display_unit(spec.unit)
    estimate = work.require_twin().parameters[name] if work.method else None
    value, width = "–", "–"
    if estimate is not None and estimate.value is not None:
        std = estimate.std_total
        half = None if std is None else Z95 * std * display.factor
        value, width = format_uncertainty(estimate.value * display.factor, half)
    verdict: Any = ""
    if estimate is not None:
        verdict = ui.make_badge(estimate.verdict.value, TONES[estimate.verdict].value)
    label = html.Div([get_parameter_label(name), html.Small(spec.meaning)])
    cells: list[Any] = [
        label,
        html.Div(value, className="number"),
        html.Div(width or "–", className="number"),
        display.label,
        verdict,
    ]
    if not can_fix(name):
        return [*cells, "follows", "", ""]
    return [*cells, *_build_lock_controls(work, name, None if estimate is None else estimate.value)]


def _build_lock_controls(
    work: SessionState, name: str, told_value: float | None
) -> list[Component]:
    lock, factor = work.get_lock(name), get_display_unit(get_parameter_spec(name).unit).factor
    at = lock.value if lock.kind is not LockKind.FREE else told_value
    std = lock.std if lock.kind is LockKind.PRIOR else 0.05 * abs(at or 0.0)
    label = get_parameter_label(name)

    def number(part: str, text: str, value: float | None) -> Component:
        shown = None if value is None else float(f"{value * factor:.6g}")
        return ui.make_field(
            {"lock": part, "id": name},
            f"{text} of {label}",
            hidden_label=True,
            type="number",
            debounce=True,
            step="any",
            value=shown,
        )

    return [
        ui.make_choice(
            {"lock": "kind", "id": name}, f"lock of {label}", _KINDS, lock.kind, hidden_label=True
        ),
        number("value", "locked value", at),
        number("std", "standard deviation", std),
    ]
