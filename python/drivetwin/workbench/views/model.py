# SPDX-License-Identifier: MIT
"""Model: sliders that move the simulation over the measurement, and locks for the next run."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from dash import ALL, MATCH, Input, Output, Patch, State, ctx, html, no_update
from dash.development.base_component import Component

from drivetwin._util.display_units import display_of, with_uncertainty
from drivetwin.errors import MissingParameterError
from drivetwin.estimation.result.estimate import Z95
from drivetwin.estimation.result.method import Method
from drivetwin.estimation.result.validation import Validation
from drivetwin.parameters import spec_of
from drivetwin.report.labels import parameter_label
from drivetwin.report.sections.parameters import TONES
from drivetwin.shifts.shift import shift_labels
from drivetwin.workbench.locks import Lock, LockKind, lockable, typed
from drivetwin.workbench.session import Live, Session
from drivetwin.workbench.session_state import Work
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.what_if import Slider, changes_of, display_for, sliders_of

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
        ui.hint(
            "Move a parameter: the simulation is driven by the measured engine torque and "
            "pressures again. The dotted curve is the model as identified."
        ),
        html.Div(id="model-content"),
        html.H3("Parameters and locks"),
        ui.hint(
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
    @page.callback(Output("model-content", "children"), Input(ui.due_id("model"), "data"))
    def show(session: Session, _: int) -> list[Component]:
        """Render the sliders next to the figure."""
        if session.work.method is None or not session.work.shifts:
            return [ui.hint("Nothing is identified yet.")]
        try:
            live = session.simulation()
        except MissingParameterError as incomplete:
            return [_choices(session.work), ui.hint(str(incomplete))]
        return _bench(session, live)

    @page.callback(Input("reset-sliders", "n_clicks"))
    def reset(session: Session, clicks: int | None) -> None:
        """Back to what was identified."""
        if clicks:
            session.choose_method(session.work.require_outcome().method)
            ui.announce(ui.Topic.LIVE)

    @page.callback(Input("model-method", "data-value"), Input("model-shift", "data-value"))
    def choose(session: Session, method: str | None, shift: str | None) -> None:
        """Another result or shift."""
        work = session.work
        if method is not None and Method(method) is not work.method:
            session.choose_method(Method(method))
            ui.announce(ui.Topic.LIVE)
        if shift is not None and int(shift) != work.shift:
            session.choose_shift(int(shift))
            ui.announce(ui.Topic.PHASES)


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
        session: Session, values: Sequence[float | str | None], ids: Sequence[dict[str, str]]
    ) -> tuple[Any, Any]:
        """Simulate with the parameters of the sliders."""
        begun = time.perf_counter()
        positions = {
            one["id"]: float(value) for one, value in zip(ids, values, strict=True)
            if value is not None
        }  # fmt: skip
        work = session.work
        sliders = sliders_of(work.require_twin(), work.require_shift())
        changes = changes_of(sliders, positions)
        if changes == work.changes:
            return no_update, no_update
        patch = Patch()
        for place, change in session.slide(changes).items():
            patch["data"][place]["x"] = change["x"]
            patch["data"][place]["y"] = change["y"]
        spent = 1e3 * (time.perf_counter() - begun)
        return patch, _fit(session.simulation(), f"simulated and compared in {spent:.0f} ms")


def _register_locks(page: ui.Page) -> None:
    @page.callback(Output("locks-content", "children"), Input(ui.due_id("model"), "data"))
    def show(session: Session, _: int) -> list[Component]:
        """One row for each parameter."""
        work = session.work
        return _locks(work) if work.shifts else [ui.hint("No shift is open.")]

    @page.callback(
        Input({"lock": "kind", "id": ALL}, "data-value"),
        Input({"lock": "value", "id": ALL}, "value"),
        Input({"lock": "std", "id": ALL}, "value"),
        State({"lock": "kind", "id": ALL}, "id"),
    )
    def lock(
        session: Session,
        kinds: Sequence[str],
        values: Sequence[float | None],
        stds: Sequence[float | None],
        ids: Sequence[dict[str, str]],
    ) -> None:
        """A lock was changed by hand."""
        if not isinstance(ctx.triggered_id, dict):
            return
        name = ctx.triggered_id["id"]
        place = [one["id"] for one in ids].index(name)
        wanted = typed(name, LockKind(kinds[place]), values[place], stds[place])
        if _same(wanted, session.work.lock_of(name)):
            ui.tell("")
            return
        session.set_lock(name, wanted)
        ui.tell(f"{parameter_label(name)} is {wanted.kind.value} from the next identification on")


def _same(one: Lock, other: Lock) -> bool:
    if one.kind is not other.kind or one.kind is LockKind.FREE:
        return one.kind is other.kind
    near = abs(one.value - other.value) <= 1e-5 * abs(other.value)
    return near and abs(one.std - other.std) <= 1e-5 * abs(other.std)


def _choices(work: Work) -> Component:
    methods = {method.value: method.value for method in work.results}
    shifts = {str(k): name for k, name in enumerate(shift_labels(work.shifts))}
    shown = work.require_outcome().method.value
    return ui.row(
        ui.choice("model-method", "Result", methods, shown),
        ui.choice("model-shift", "Shift", shifts, str(work.shift)),
        ui.button("As identified", "reset-sliders"),
    )


def _bench(session: Session, live: Live) -> list[Component]:
    work = session.work
    sliders = sliders_of(work.require_twin(), work.require_shift())
    return [
        _choices(work),
        html.Div(
            [
                html.Div([_slider(one, work.changes) for one in sliders], className="sliders"),
                html.Div(
                    [
                        html.Div(_fit(live, ""), id="model-fit"),
                        ui.graph("model-plot", "Simulation over measurement", live.figure),
                    ]
                ),
            ],
            className="bench",
        ),
    ]


def _slider(one: Slider, changes: Mapping[str, float]) -> Component:
    value = one.value
    if one.id in changes:
        value = round(changes[one.id] * display_for(one.id).factor / one.step) * one.step
    limits = {"min": one.low, "max": one.high, "step": one.step, "value": value}
    return html.Div(
        [
            html.Div([one.label, html.Small(one.unit)], className="name"),
            ui.field(
                {"part": "range", "id": one.id},
                f"{one.label}, slider",
                hidden_label=True,
                type="range",
                **limits,
            ),
            ui.field(
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


def _fit(live: Live, remark: str) -> list[Component]:
    """Fit of the present run, and of the one as identified."""
    rows = [
        (
            name.replace("_", " "),
            _percent(live.present, name),
            _percent(live.identified, name),
        )
        for name in live.present.fit
    ]
    parts = [ui.table(("fit over the whole shift", "now", "as identified"), rows)]
    status = live.present.status
    text = remark if status == "completed" else f"the simulation ended early: {status}"
    return [*parts, ui.hint(text)]


def _percent(run: Validation, name: str) -> str:
    return f"{run.fit[name]['all'].fit_percent:.2f} %"


def _locks(work: Work) -> list[Component]:
    names = list(work.require_twin().parameters) if work.method else _usual_ids(work)
    head = ("parameter", "value", "± 95 %", "unit", "verdict", "lock", "at", "± std")
    return [ui.table(head, [_lock_row(work, name) for name in names], name="locks")]


def _usual_ids(work: Work) -> list[str]:
    """List the parameters that can be fixed before an identification."""
    gears = dict.fromkeys(g for s in work.shifts for g in (s.start_gear, s.end_gear))
    elements = dict.fromkeys(e for s in work.shifts for e in (s.offgoing, s.oncoming))
    return [
        "eta",
        *(f"J_prime_{gear}" for gear in gears),
        *("J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay"),
        *(f"P0.{element}" for element in elements),
    ]


def _lock_row(work: Work, name: str) -> list[Any]:
    spec = spec_of(name)
    display = display_of(spec.unit)
    estimate = work.require_twin().parameters[name] if work.method else None
    value, width = "–", "–"
    if estimate is not None and estimate.value is not None:
        std = estimate.std_total
        half = None if std is None else Z95 * std * display.factor
        value, width = with_uncertainty(estimate.value * display.factor, half)
    verdict: Any = ""
    if estimate is not None:
        verdict = ui.badge(estimate.verdict.value, TONES[estimate.verdict].value)
    label = html.Div([parameter_label(name), html.Small(spec.meaning)])
    cells: list[Any] = [
        label,
        html.Div(value, className="number"),
        html.Div(width or "–", className="number"),
        display.label,
        verdict,
    ]
    if not lockable(name):
        return [*cells, "follows", "", ""]
    return [*cells, *_lock_controls(work, name, None if estimate is None else estimate.value)]


def _lock_controls(work: Work, name: str, told_value: float | None) -> list[Component]:
    lock, factor = work.lock_of(name), display_of(spec_of(name).unit).factor
    at = lock.value if lock.kind is not LockKind.FREE else told_value
    std = lock.std if lock.kind is LockKind.PRIOR else 0.05 * abs(at or 0.0)
    label = parameter_label(name)

    def number(part: str, text: str, value: float | None) -> Component:
        shown = None if value is None else float(f"{value * factor:.6g}")
        return ui.field(
            {"lock": part, "id": name},
            f"{text} of {label}",
            hidden_label=True,
            type="number",
            debounce=True,
            step="any",
            value=shown,
        )

    return [
        ui.choice(
            {"lock": "kind", "id": name}, f"lock of {label}", _KINDS, lock.kind, hidden_label=True
        ),
        number("value", "locked value", at),
        number("std", "standard deviation", std),
    ]
