# SPDX-License-Identifier: MIT
"""Phases: the shift with its boundaries, dragged in the figure or typed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dash import ALL, Dash, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin._util.display_units import display_of, significant
from drivetwin.report.sections.summary import phase_key
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift, shift_labels
from drivetwin.workbench.phases import LABELS, dragged, phase_figure, shown_times, typed
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.session_state import Work
from drivetwin.workbench.views.widgets import (
    Topic,
    acted,
    announce,
    button,
    choice,
    due_id,
    field,
    graph,
    hint,
    notes,
    row,
    table,
    tell,
    told,
)


def layout() -> list[Component]:
    """The figure and the times."""
    return [
        hint(
            "Drag a dashed line to move a phase boundary, or type its time. What is set by hand "
            "counts for the next identification."
        ),
        html.Div(id="phases-content"),
    ]


def register(app: Dash, sessions: Sessions) -> None:
    """Moving boundaries."""
    _register_figure(app, sessions)
    _register_fields(app, sessions)


def _register_figure(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Output("phases-content", "children"),
        Input(due_id("phases"), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def show(_: int, key: str) -> list[Component]:
        """The shift that is chosen."""
        work = sessions.get(key).work
        return _content(work) if work.shifts else [hint("No shift is open.")]

    @app.callback(
        Input("phases-plot", "relayoutData"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @acted
    def drag(change: dict[str, Any] | None, key: str) -> None:
        """A line was dragged."""
        session = sessions.get(key)
        work = session.work
        if not change or not any(name.startswith("shapes[") for name in change):
            return
        moves = dragged(phase_figure(work.require_log(), work.require_shift()), change)
        announce(Topic.PHASES)
        if moves:
            session.move(work.shift, moves)
            tell("; ".join(f"{LABELS[one]} at {time:.4f} s" for one, time in moves.items()))


def _register_fields(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Input("apply-phases", "n_clicks"),
        State("session", "data"),
        State({"boundary": ALL}, "value"),
        prevent_initial_call=True,
    )
    @acted
    def apply(clicks: int | None, key: str, times: Sequence[float | None]) -> None:
        """Times were typed."""
        if not clicks:
            return
        session = sessions.get(key)
        changes = typed(session.work.require_shift(), times)
        if not changes:
            tell("No time was changed")
            return
        session.move(session.work.shift, changes)
        announce(Topic.PHASES)
        tell("The phases are set")

    @app.callback(
        Input("reset-phases", "n_clicks"), State("session", "data"), prevent_initial_call=True
    )
    @acted
    def reset(clicks: int | None, key: str) -> None:
        """Back to what was detected."""
        if not clicks:
            return
        session = sessions.get(key)
        session.move(session.work.shift, {})
        announce(Topic.PHASES)
        tell("The phases are as detected")

    @app.callback(
        Input("phases-shift", "data-value"), State("session", "data"), prevent_initial_call=True
    )
    @acted
    def choose(shift: str | None, key: str) -> None:
        """Another shift of the log."""
        session = sessions.get(key)
        if shift is not None and int(shift) != session.work.shift:
            session.choose_shift(int(shift))
            announce(Topic.PHASES)


def _content(work: Work) -> list[Component]:
    shift = work.require_shift()
    names = {str(k): name for k, name in enumerate(shift_labels(work.shifts))}
    fields = [
        field(
            {"boundary": one.value},
            f"{LABELS[one]} [s]",
            type="number",
            value=time,
            step="any",
        )
        for one, time in shown_times(shift).items()
    ]
    return [
        row(choice("phases-shift", "Shift", names, str(work.shift)), *fields),
        row(
            button("Apply times", "apply-phases", main=True),
            button("As detected", "reset-phases"),
        ),
        graph(
            "phases-plot",
            "The shift over time with its phases",
            phase_figure(work.require_log(), shift),
            edits={"shapePosition": True},
        ),
        hint(phase_key(shift.kind)),
        notes("About this shift", shift.warnings),
        _quality(shift),
    ]


def _quality(shift: Shift) -> Component:
    rows = []
    for name, value in shift.quality.items():
        display = display_of(QUALITY_UNITS[name])
        text = f"{significant(value * display.factor, 3)} {display.label}"
        rows.append((name.replace("_", " "), text))
    return table(("figure", "value"), rows, "Shift quality")
