# SPDX-License-Identifier: MIT
"""The page around the views: navigation, status line, message, and the start of a session."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dash import Dash, Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.report.html import read_template
from drivetwin.workbench.session import Session, Sessions
from drivetwin.workbench.session_state import Source
from drivetwin.workbench.views import (
    card,
    channels,
    export,
    identify,
    log,
    model,
    shifts,
    workspace,
)
from drivetwin.workbench.views.stepper import (
    TITLES,
    Step,
    build_navigation,
    build_panel,
    register_states,
)
from drivetwin.workbench.views.widgets import (
    Page,
    Topic,
    make_due_id,
    make_topic_id,
    notify_topic,
    show_errors,
)


@dataclass(frozen=True)
class Start:
    """Files named on the command line, opened when a session begins."""

    log: Source | None = None
    card: Source | None = None
    mapping: Path | None = None


_STEPS = {
    Step.LOG: log,
    Step.CHANNELS: channels,
    Step.CARD: card,
    Step.SHIFTS: shifts,
    Step.IDENTIFY: identify,
    Step.MODEL: model,
    Step.EXPORT: export,
}
_MORE = {
    "workspace": ("Workspace", workspace),
}
VIEWS = {**{step.value: (TITLES[step], view) for step, view in _STEPS.items()}, **_MORE}
"""Title and module of each view: the steps in order, then those beside them."""
_TOPICS = {
    "log": (Topic.LOG, Topic.SELECTION),
    "channels": (Topic.LOG, Topic.SELECTION),
    "card": (Topic.LOG, Topic.FORM),
    "shifts": (Topic.PHASES,),
    "identify": (Topic.RESULTS, Topic.PHASES, Topic.LOCKS, Topic.HELD),
    "model": (Topic.RESULTS, Topic.LIVE),
    "workspace": (Topic.LOG,),
}
"""Topics of a session that each view depends on."""
_DUE = """(hidden, ...rest) => {
  const drawn = rest.pop();
  const present = rest.join(" ").trim();
  return hidden || !present || present === drawn ? dash_clientside.no_update : present;
}"""
_INDEX = """<!DOCTYPE html>
<html lang="en">
  <head>{%metas%}<title>{%title%}</title>{%favicon%}{%css%}
    <style>STATUS</style></head>
  <body>{%app_entry%}<footer hidden>{%config%}{%scripts%}{%renderer%}</footer></body>
</html>"""
_SWITCH = """(...clicked) => {
  const names = NAMES;
  const times = clicked.map((time) => time ?? -1);
  const last = Math.max(...times);
  const at = names.includes(location.hash.slice(1)) ? location.hash.slice(1) : names[0];
  const id = last < 0 ? at : names[times.indexOf(last)];
  if (id !== at) history.pushState(null, "", `#${id}`);
  setTimeout(() => window.dispatchEvent(new Event("resize")), 0);
  const current = names.map((name) => (name === id ? "page" : "false"));
  return [...names.map((name) => name !== id), ...current];
}"""
"""By the times of clicks: of several that a busy page answers together the last one counts.

The view stands in the address, for the browser's way back and for loading the page again.
"""


def build_page(app: Dash, sessions: Sessions, start: Start) -> None:
    """Give the application its layout and the callbacks of all views."""
    app.index_string = _INDEX.replace("STATUS", read_template("status.css"))
    app.layout = _build_layout
    _register_view_switch(app)
    _register_drawing(app)
    _register_entry(app, sessions, start)
    _show_status(app, sessions)
    register_states(app, sessions)
    for _, view in VIEWS.values():
        view.register(Page(app, sessions))


def _build_layout() -> Component:
    panels = [
        build_panel(name, title, view.layout(), hidden=name != Step.LOG)
        for name, (title, view) in VIEWS.items()
    ]
    return html.Div(
        [
            dcc.Store(id="session", storage_type="session"),
            *(dcc.Store(id=make_topic_id(topic)) for topic in Topic),
            *(dcc.Store(id=make_due_id(name)) for name in _TOPICS),
            build_navigation({name: title for name, (title, _) in _MORE.items()}),
            html.Main(
                [
                    html.P(id="status", className="status"),
                    html.Div(id="message", role="status", className="message"),
                    *panels,
                ]
            ),
        ],
        className="shell",
    )


def _register_view_switch(app: Dash) -> None:
    script = _SWITCH.replace("NAMES", str(list(VIEWS)))
    app.clientside_callback(  # type: ignore[no-untyped-call]
        script,
        *(Output(f"view-{name}", "hidden") for name in VIEWS),
        *(Output(f"nav-{name}", "aria-current") for name in VIEWS),
        *(Input(f"nav-{name}", "n_clicks_timestamp") for name in VIEWS),
    )


def _register_drawing(app: Dash) -> None:
    """A view is drawn when it is looked at: all of them at once would keep the browser busy."""
    for name, topics in _TOPICS.items():
        app.clientside_callback(  # type: ignore[no-untyped-call]
            _DUE,
            Output(make_due_id(name), "data"),
            Input(f"view-{name}", "hidden"),
            *(Input(make_topic_id(topic), "data") for topic in topics),
            State(make_due_id(name), "data"),
        )


def _register_entry(app: Dash, sessions: Sessions, start: Start) -> None:
    @app.callback(
        Output("session", "data"), Input("session", "modified_timestamp"), State("session", "data")
    )
    @show_errors
    def enter(_: object, key: object) -> object:
        """Go on with the session of this tab, or begin one with what the command line named."""
        if key in sessions:
            notify_topic(Topic.LOG)
            return no_update
        fresh = sessions.create()
        if start.log is not None:
            _open_first(sessions.get(fresh), start)
        return fresh


@show_errors
def _open_first(session: Session, start: Start) -> None:
    if start.log is not None:
        session.open(start.log, start.card, start.mapping)


def _show_status(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Output("status", "children"),
        Input(make_topic_id(Topic.LOG), "data"),
        Input(make_topic_id(Topic.RESULTS), "data"),
        Input(make_topic_id(Topic.SELECTION), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    def status(
        _log: object, _results: object, _selection: object, key: object
    ) -> list[Component | str]:
        """Format the status line: open files and available results."""
        if key not in sessions:
            return []
        work = sessions.get(key).work
        if work.log is None or work.opened is None:
            return ["no log is open"]
        others = len(work.logs) - 1
        parts: list[Component | str] = [html.B(work.log.name)]
        if others:
            parts.append(f" and {others} more {'log' if others == 1 else 'logs'}")
        parts.append(f" · {'no card' if work.card is None else f'card {work.card.name}'}")
        for shift in work.shifts:
            parts.append(f" · shift {shift.name}")
        if work.result is not None:
            parts.append(" · identified")
        if work.bus is not None:
            parts.append(f" · identified: {len(work.bus.found.shifts)} shifts of bus logs")
        return parts
